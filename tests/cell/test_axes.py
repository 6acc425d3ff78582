"""What varying an axis changes: the instances trained on, the reward paid, the policy that a cell starts from."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from builders import sweep, toy_cells
from codesign_bench import load_policy, load_results
from codesign_bench.cell.axes import axes, axis_named, keeps_returns, parse_axis_value
from codesign_bench.cell.cell import Cell, resolve_cell, resolve_cells
from codesign_bench.cell.variant import DEFAULT, Variant
from codesign_bench.cli import main
from codesign_bench.errors import UserError
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.method import Problem
from codesign_bench.storage.records import CellRecord
from codesign_bench.task import Task, load_task
from codesign_bench.task.episodes import Tradeoff

pytestmark = pytest.mark.usefixtures("toy")

OVERRIDES = ("evaluations=4", "fine_tuning_steps=120")
STARTS = [Variant.of(finetune=1), Variant.of(finetune=2), Variant.of(scratch=1), Variant.of(scratch=2)]


def cells(seeds: int = 1, **changes: Any) -> list[Cell]:
    """Return toy cells with the budget of their profile."""
    return toy_cells(seeds, **{"steps": None, "overrides": OVERRIDES, **changes})


def problem_of(variant: Variant) -> Problem:
    """Return what a toy cell's method is asked to learn."""
    (cell,) = cells(variants=[variant])
    return resolve_cell(cell).problem()


@pytest.fixture
def trained(tmp_path: Path) -> Path:
    """A results folder with two finished default cells."""
    assert sweep(cells(2, overrides=(*OVERRIDES, "steps=400")), tmp_path)[0] == 0
    return tmp_path


def test_cells_keep_their_returns_unless_reward_or_instances_change() -> None:
    for variant in (DEFAULT, Variant.of(cutout=0.5)):
        problem = problem_of(variant)
        assert (problem.tradeoff, problem.instances, keeps_returns(variant)) == (None, None, True)
    for variant in (Variant.of(alpha=0.3), Variant.of(cutout=0.5, alpha=0.3), *STARTS):
        problem = problem_of(variant)
        assert problem.tradeoff is not None or problem.instances is not None
        assert not keeps_returns(variant)
    assert not keeps_returns(Variant.of(setting=1)), "judged on validation instances"
    assert not keeps_returns(Variant.of(somebodys=1)), "of an axis that is not known here"


def test_a_cutout_and_a_tradeoff_are_parts_of_the_problem() -> None:
    problem = problem_of(Variant.of(cutout=0.5, alpha=0.3))
    assert (problem.cutout, problem.tradeoff) == (0.5, Tradeoff(0.3, 1.0))
    plain = problem_of(DEFAULT)
    assert (plain.cutout, plain.tradeoff, plain.instances) == (0.0, None, None)


def test_fine_tuning_starts_where_training_ended_and_scratch_does_not(trained: Path) -> None:
    wanted = cells(2, variants=STARTS)
    assert sweep(wanted, trained)[0] == 0
    goals = load_task("toy_reach").fine_tuning_instances()
    for cell in wanted:
        curve = pd.read_csv(cell.folder(trained) / "curve.csv")
        assert curve["env_steps"].iloc[-1] >= 120
        problem = resolve_cell(cell).problem()
        ((_, number),) = cell.variant
        assert problem.evaluation_instances().tolist() == goals[int(number) - 1].tolist()
        if cell.pretrained is not None:
            policy = load_policy(cell.pretrained.folder(trained))
            start = evaluate(problem.task, policy, instances=problem.evaluation_instances())
            assert curve["return_mean"].iloc[0] == pytest.approx(start.returns.mean())
    frame = load_results(trained)
    assert set(frame["variant"]) == {"default", *(variant.name for variant in STARTS)}
    firsts = frame[(frame["env_steps"] == 0) & (frame["seed"] == 0)].set_index("variant")["return_mean"]
    assert firsts["finetune-1"] != firsts["scratch-1"]


def test_only_the_instances_of_its_place_are_trained_on() -> None:
    problem = problem_of(Variant.of(scratch=2))
    drawn = problem.sample_instances(np.random.default_rng(0), 20)
    assert {goal for (goal,) in drawn.tolist()} == {0.3, 0.35}
    task = load_task("toy_reach")
    assert Problem(task).evaluation_instances().tolist() == task.evaluation_instances().tolist()


def test_the_budget_is_that_of_fine_tuning_unless_steps_are_given(trained: Path) -> None:
    (cell,) = cells(variants=[Variant.of(finetune=1)])
    assert resolve_cell(cell).config.run.steps == 120
    (longer,) = cells(variants=[Variant.of(finetune=1)], steps=500)
    assert resolve_cell(longer).config.run.steps == 500
    assert sweep([cell], trained)[0] == 0
    record = CellRecord.read(cell.folder(trained))
    assert record is not None
    assert record.config.run["steps"] == (120, "fine_tuning_steps")


def test_gradient_steps_are_counted_along_the_curve(trained: Path) -> None:
    curve = pd.read_csv(cells()[0].folder(trained) / "curve.csv")
    assert curve["gradient_steps"].iloc[0] == 0
    assert curve["gradient_steps"].is_monotonic_increasing
    assert curve["gradient_steps"].iloc[-1] > 4


def test_fine_tuning_without_a_finished_default_cell_says_what_to_run(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="starts from toy_reach/toy_search/default/seed-00, which is not done") as error:
        sweep(cells(variants=[Variant.of(finetune=1)]), tmp_path)
    assert f"--seeds 0-0 --profile laptop --out {tmp_path}" in str(error.value)


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"cutout": 1.0}, "--variant cutout=1.0: expected a number above 0 to below 1"),
        ({"alpha": -0.1}, "--variant alpha=-0.1: expected a number from 0 to 1"),
        ({"scratch": 3}, "--scratch 3: task 'toy_reach' has fine-tuning places 1 to 2"),
        ({"finetune": 0}, "--finetune 0: task 'toy_reach' has fine-tuning places 1 to 2"),
        ({"setting": -1}, "--variant setting=-1: expected an integer from 0"),
        ({"colour": "red"}, "unknown axis 'colour'; choose from: cutout, alpha, finetune, scratch"),
    ],
)
def test_a_value_that_a_task_cannot_have_is_refused_before_anything_runs(values: dict[str, Any], named: str) -> None:
    with pytest.raises(UserError, match=named):
        resolve_cells(cells(variants=[Variant.of(**values)]))


def test_a_task_without_positions_refuses_a_cutout(monkeypatch: pytest.MonkeyPatch) -> None:
    import toy

    monkeypatch.setattr(toy.ToyReach, "in_cutout", Task.in_cutout)
    with pytest.raises(UserError, match=r"--cutout.*toy_reach"):
        resolve_cells(cells(variants=[Variant.of(cutout=0.4)]))


def test_a_task_without_fine_tuning_instances_says_so(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    arguments = ["run", "--method", "gnn_ppo", "--task", "push", "--scratch", "1", "--out", str(tmp_path)]
    assert main(arguments) == 2
    assert "task 'push' has no fine-tuning instances" in capsys.readouterr().err


def test_values_are_read_by_the_kind_of_their_axis() -> None:
    assert parse_axis_value("alpha", "1") == 1.0
    assert parse_axis_value("finetune", "2") == 2
    for name, text in (("finetune", "half"), ("alpha", "nan"), ("cutout", "1"), ("rung", "-1")):
        with pytest.raises(UserError, match=f"--variant {name}={text}: expected"):
            parse_axis_value(name, text)
    assert list(axes())[:4] == ["cutout", "alpha", "finetune", "scratch"]
    assert axis_named("scratch").exclusive == axis_named("finetune").exclusive != ""
