"""What is shipped under `results/reference` fits together: cells, policies, figures, claims, tables.

Each test takes what is shipped as it is; none demands that there be results of some task or method.
"""

from __future__ import annotations

import json
import subprocess
import sys
from itertools import groupby
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from codesign_bench.cell.cell import Cell, resolve_cell
from codesign_bench.cell.variant import DEFAULT
from codesign_bench.cli import main
from codesign_bench.config.resolve import differences
from codesign_bench.deployment.conditions import TRIAL
from codesign_bench.deployment.deploy import Order, deploy
from codesign_bench.deployment.tables import load_deployment
from codesign_bench.storage.cells import StoredCell, find_cells
from codesign_bench.storage.layout import EVALUATION_FILE
from codesign_bench.storage.policies import policy_and_task
from codesign_bench.storage.reference_points import BEST_KNOWN, INSTANCES_FILE, load_reference_points

REFERENCE = Path(__file__).resolve().parents[2] / "results" / "reference"

if not REFERENCE.is_dir():
    pytest.skip("a source distribution leaves the results out", allow_module_level=True)

pytestmark = pytest.mark.reference

CELLS = list(find_cells(REFERENCE))
DEFAULTS = [cell for cell in CELLS if cell.record.variant == DEFAULT]
FIRST = [next(group) for _, group in groupby(DEFAULTS, lambda cell: (cell.record.task, cell.record.method))]
"""One cell of each task and method; cells come in the order of their folders."""
FIRST_TRIALS = load_deployment(REFERENCE).query("kind == 'own' and trial == 1")
TOOLS_THAT_WORKED = FIRST_TRIALS[FIRST_TRIALS["success"] == 1].groupby("task").tail(1)
"""Of each task on an arm, one tool that succeeded in its first trial."""


def name_of(cell: StoredCell) -> str:
    """Return a cell's path below the results folder, for the name of a test."""
    return cell.folder.relative_to(REFERENCE).as_posix()


def test_every_shipped_cell_is_finished_and_spent_its_budget() -> None:
    for cell in CELLS:
        assert cell.is_done, cell.folder
        budget = cell.record.config.run["steps"].value
        # A batch of one-seed methods may end on the budget's last episode; none stops short of it.
        assert cell.record.env_steps >= budget, cell.folder


def test_the_pages_say_what_the_results_say() -> None:
    checked = subprocess.run(
        [sys.executable, str(REFERENCE.parent / "fill_tables.py"), "--check"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert checked.returncode == 0, f"{checked.stdout}{checked.stderr}; run: python results/fill_tables.py"


def test_the_shipped_claims_are_those_of_the_shipped_results(tmp_path: Path) -> None:
    assert main(["verify", "--results", str(REFERENCE), "--out", str(tmp_path)]) == 0
    made, shipped = (
        [
            {row["name"]: row["verdict"] for row in json.loads((folder / "claims.json").read_text())[part]}
            for part in ("claims", "checks_of_scenes")
        ]
        for folder in (tmp_path, REFERENCE / "claims")
    )
    assert made == shipped


def test_the_shipped_figures_show_the_shipped_cells(tmp_path: Path) -> None:
    names = ["learning_curves", "final_results", "fine_tuning", "baseline_sweep"]
    assert main(["plot", *names, "--results", str(REFERENCE), "--out", str(tmp_path)]) == 0
    for name in names:
        made, shipped = (pd.read_csv(folder / f"{name}.csv") for folder in (tmp_path, REFERENCE / "figures"))
        pd.testing.assert_frame_equal(made, shipped, obj=name)


def test_nothing_is_above_the_best_known() -> None:
    points, instances = load_reference_points(REFERENCE), pd.read_csv(REFERENCE / INSTANCES_FILE)
    for task, rows in points.groupby("task"):
        best = rows[rows["point"] == BEST_KNOWN].iloc[0]
        assert (rows[["return_mean", "success_rate"]] <= best[["return_mean", "success_rate"]]).all(axis=None), task
        assert (instances["task"] == task).sum() == rows["instances"].sum()
    means = instances.groupby(["task", "point"])[["return", "success"]].mean().to_numpy()
    stored = points.set_index(["task", "point"]).sort_index()[["return_mean", "success_rate"]].to_numpy()
    assert means == pytest.approx(stored)


def test_the_folder_stays_small() -> None:
    assert sum(path.stat().st_size for path in REFERENCE.rglob("*") if path.is_file()) < 100e6


def test_the_evaluation_of_a_shipped_cell_is_the_end_of_its_curve() -> None:
    for cell in CELLS:
        episodes, last = pd.read_csv(cell.folder / EVALUATION_FILE), cell.last_evaluation()
        assert episodes["return"].mean() == pytest.approx(last["return_mean"]), cell.folder
        assert episodes["success"].mean() == pytest.approx(last["success_rate"]), cell.folder


@pytest.mark.parametrize("cell", FIRST, ids=name_of)
def test_the_profile_of_a_shipped_cell_still_means_what_it_was(cell: StoredCell) -> None:
    record = cell.record
    wanted = Cell(record.task, record.method, record.seed, record.variant, record.profile)
    assert differences(record.config, resolve_cell(wanted).config) == []


def test_every_shipped_tool_was_tried_equally_often() -> None:
    trials = load_deployment(REFERENCE).groupby(["task", "kind", "policy_seed", "tool"]).size()
    assert (trials.groupby(["task", "kind"]).nunique() == 1).all()


@pytest.mark.numeric
@pytest.mark.parametrize("stored", TOOLS_THAT_WORKED.to_dict("records"), ids=lambda stored: stored["task"])
def test_a_shipped_policy_succeeds_on_the_panda_as_its_table_says(stored: dict[str, Any], tmp_path: Path) -> None:
    cells = {(cell.record.task, cell.record.method, cell.record.seed): cell for cell in DEFAULTS}
    cell = cells[stored["task"], "gnn_ppo", stored["policy_seed"]]
    policy, task = policy_and_task(cell.folder, stored["task"])
    (again,) = deploy(task, policy, Order(TRIAL, tools=(stored["tool"],), gifs=False), tmp_path, lambda line: None)
    # Another processor rounds otherwise. Under no instruction set did that move a success by a single step; where
    # contact makes more of it, the same course comes to its end a few steps earlier or later.
    assert again["success"] == 1
    assert again["steps"] == pytest.approx(stored["steps"], abs=5)
