"""The paper's experiments have the paper's cells."""

from __future__ import annotations

import io
import json
import shutil
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from rich.console import Console

from builders import VERSION_0_1_0
from codesign_bench.claims import deployment
from codesign_bench.claims.fine_tuning import SEEDS_TO_DECIDE
from codesign_bench.errors import UserError
from codesign_bench.storage.records import CellRecord
from codesign_bench.studies.corl2023 import experiments
from codesign_bench.studies.corl2023.experiments import EXPERIMENTS
from codesign_bench.studies.corl2023.members import METHODS, TASKS
from codesign_bench.studies.corl2023.protocol import PROTOCOL
from codesign_bench.study import stages_of
from codesign_bench.task import load_task


def variants(name: str, profile: str = "paper") -> dict[str, int]:
    """Return the seeds of each variant that an experiment needs on one task."""
    cells = [cell for stage in stages_of([EXPERIMENTS[name]], profile) for cell in stage]
    found = {cell.variant.name for cell in cells}
    return {variant: len({cell.seed for cell in cells if cell.variant.name == variant}) for variant in found}


def test_the_papers_protocol() -> None:
    curves = [cell for stage in stages_of([EXPERIMENTS["learning_curves"]], "paper") for cell in stage]
    assert len(curves) == 5 * 5 * 6 + 5 * 3  # Six seeds on five tasks, three on the sixth.
    assert {cell.method for cell in curves} == set(METHODS)
    assert {cell.task for cell in curves} == set(TASKS)
    assert variants("generalization") == {f"cutout-{share:.2f}": 3 for share in (0.1, 0.2, 0.4, 0.6, 0.8, 0.9)}
    assert variants("tradeoff") == {f"alpha-{alpha:.2f}": 3 for alpha in (0.0, 0.3, 0.7, 1.0)}
    starts = {f"{kind}-{start}": SEEDS_TO_DECIDE for kind in ("finetune", "scratch") for start in (1, 2, 3, 4)}
    assert variants("fine_tuning") == {"default": SEEDS_TO_DECIDE, **starts}
    assert variants("deployment") == {"default": deployment.FEWEST_SEEDS}


def test_tasks_have_what_their_experiments_ask_for() -> None:
    task = load_task("fetch_cube")
    assert len(task.fine_tuning_instances()) == len(PROTOCOL.fine_tuning_starts)
    for fraction in PROTOCOL.cutout_fractions:
        assert task.in_cutout(task.evaluation_instances(), fraction).any()


@pytest.mark.parametrize(("seed", "table"), [(0, "protocol.csv"), (100, "protocol-seed-100.csv")])
def test_the_trials_on_an_arm_are_played_once_with_whatever_seed_is_finished(
    seed: int, table: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    default = Path("lift_cup/gnn_ppo/default")
    cell = default / f"seed-{seed:02d}"
    monkeypatch.setattr(experiments, "ON_AN_ARM", ("lift_cup",))
    shutil.copytree(VERSION_0_1_0 / default / "seed-00", tmp_path / cell)
    record = CellRecord.read(tmp_path / cell)
    assert record is not None
    replace(record, seed=seed, task_version=load_task("lift_cup").version).write(tmp_path / cell)

    def played() -> str:
        console = Console(record=True, width=300, file=io.StringIO())
        experiments.deploy(tmp_path, "laptop", console.print)
        return console.export_text()

    assert "own-tool-1-trial-1: " in played()
    trials = tmp_path / "deployment" / "lift_cup" / table
    assert len(pd.read_csv(trials)) == 4 * 5
    policy = json.loads(trials.with_suffix(".json").read_text(encoding="utf-8"))["policy"]
    assert policy == cell.as_posix(), "the cell's name, not where this machine has it"
    assert "own-tool-1-trial-1: " not in played()


def test_without_a_finished_seed_the_first_is_asked_for(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="seed-00"):
        experiments.deploy(tmp_path, "laptop", Console(quiet=True).print)
