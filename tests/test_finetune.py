"""Going on from a trained policy with one instance, and learning that instance from scratch (paper, section 5.2)."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

from codesign_bench import load_policy, load_results
from codesign_bench.cell.cell import Cell, check_cells, grid
from codesign_bench.cli import main
from codesign_bench.errors import UserError
from codesign_bench.method import Method, Problem, load_method, method_names
from codesign_bench.seeding import Streams
from codesign_bench.storage.results import read_cell
from codesign_bench.sweep.runner import run_sweep
from codesign_bench.task import load_task

pytestmark = pytest.mark.usefixtures("toy")

OVERRIDES = ("evaluations=4", "fine_tuning_steps=120")


def cells(seeds: int = 1, **variants: Any) -> list[Cell]:
    """Return toy cells."""
    return list(grid(tasks=["toy_reach"], methods=["toy_search"], seeds=range(seeds), overrides=OVERRIDES, **variants))


def sweep(wanted: list[Cell], out: Path) -> int:
    """Run a sweep and return its exit code."""
    return run_sweep(wanted, out, console=Console(file=io.StringIO()))


@pytest.fixture
def trained(tmp_path: Path) -> Path:
    """A results folder with two finished default cells."""
    defaults = list(
        grid(tasks=["toy_reach"], methods=["toy_search"], seeds=range(2), overrides=(*OVERRIDES, "steps=400"))
    )
    assert sweep(defaults, tmp_path) == 0
    return tmp_path


def test_variants_are_named_by_the_instances_number() -> None:
    (fine_tuned, from_scratch) = cells(finetunes=[1], scratches=[2])
    assert (fine_tuned.variant, from_scratch.variant) == ("finetune-1", "scratch-2")
    assert (fine_tuned.start, from_scratch.start, cells()[0].start) == (1, 2, None)
    assert fine_tuned.pretrained() == cells()[0]
    assert Cell.from_json(fine_tuned.to_json()) == fine_tuned


def test_fine_tuning_starts_where_training_ended_and_scratch_does_not(trained: Path) -> None:
    wanted = cells(seeds=2, finetunes=[1, 2], scratches=[1, 2])
    assert sweep(wanted, trained) == 0
    goal = load_task("toy_reach").fine_tuning_instances()
    for cell in wanted:
        curve = pd.read_csv(cell.folder(trained) / "curve.csv")
        assert curve["env_steps"].iloc[-1] >= 120
        policy: Any = load_policy(cells(seeds=2)[cell.seed].folder(trained))
        problem = cell.problem(cell.config())
        assert problem.evaluation_instances().tolist() == [goal[(cell.start or 0) - 1].tolist()]
        if cell.finetune is not None:
            from codesign_bench.evaluation.evaluate import evaluate

            start = evaluate(problem.task, policy, instances=problem.evaluation_instances())
            assert curve["return_mean"].iloc[0] == pytest.approx(start.returns[0])
    frame = load_results(trained)
    assert set(frame["variant"]) == {"default", "finetune-1", "finetune-2", "scratch-1", "scratch-2"}
    firsts = frame[(frame["env_steps"] == 0) & (frame["seed"] == 0)].set_index("variant")["return_mean"]
    assert firsts["finetune-1"] != firsts["scratch-1"]


def test_only_its_own_instance_is_trained_on() -> None:
    task = load_task("toy_reach")
    problem = Problem(task, instances=task.fine_tuning_instances()[1:2])
    assert problem.sample_instances(np.random.default_rng(0), 5).tolist() == [[0.3]] * 5
    assert Problem(task).evaluation_instances().tolist() == task.evaluation_instances().tolist()


def test_the_budget_is_that_of_fine_tuning_unless_steps_are_given(trained: Path) -> None:
    (cell,) = cells(finetunes=[1])
    assert cell.config().run.steps == 120
    (longer,) = cells(finetunes=[1], steps=500)
    assert longer.config().run.steps == 500
    assert sweep([cell], trained) == 0
    stored = read_cell(cell.folder(trained))
    assert stored is not None
    assert stored["config"]["run"]["steps"] == {"value": 120, "source": "fine_tuning_steps"}


def test_gradient_steps_are_counted_along_the_curve(trained: Path) -> None:
    curve = pd.read_csv(cells()[0].folder(trained) / "curve.csv")
    assert curve["gradient_steps"].iloc[0] == 0
    assert curve["gradient_steps"].is_monotonic_increasing
    assert curve["gradient_steps"].iloc[-1] > 4


def test_fine_tuning_without_a_finished_default_cell_says_what_to_run(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="goes on from toy_reach/toy_search/default/seed-00, which is not done") as told:
        sweep(cells(finetunes=[1]), tmp_path)
    assert f"--seeds 0-0 --profile laptop --out {tmp_path}" in str(told.value)


def test_bad_input_gets_one_line(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    with pytest.raises(UserError, match="fine-tuning instance 3: task 'toy_reach' has 1 to 2"):
        check_cells(cells(scratches=[3]))
    arguments = ["run", "--method", "gnn_ppo", "--task", "push", "--scratch", "1", "--out", str(tmp_path)]
    assert main(arguments) == 2
    assert "task 'push' names no instances for fine-tuning" in capsys.readouterr().err


@pytest.mark.parametrize("name", [name for name in method_names() if name != "toy_search"])
def test_a_method_takes_over_a_policy_or_says_that_it_cannot(name: str) -> None:
    task, method_class = load_task("toy_reach"), load_method(name)
    config: Any = method_class.config_class()
    donor, heir = (method_class(Problem(task), config, Streams(seed)) for seed in (0, 1))
    if method_class.start_from is Method.start_from:
        with pytest.raises(UserError, match=f"method '{name}' cannot go on from a trained policy"):
            heir.start_from(donor.policy().tensors())
        return
    heir.start_from(donor.policy().tensors())
    for key, array in donor.policy().tensors().items():
        np.testing.assert_array_equal(heir.policy().tensors()[key], array, err_msg=key)
