"""`results/ship_cells.py` copies what is finished, leaves what only resuming needs, and replaces nothing."""

from __future__ import annotations

import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import codesign_bench as cb
from builders import VERSION_0_1_0
from codesign_bench.storage.layout import CHECKPOINT_FILE, LOG_FILE
from codesign_bench.storage.records import DONE, RUNNING, CellRecord

SCRIPT = Path(__file__).resolve().parents[2] / "results" / "ship_cells.py"
FIRST = Path("push/gnn_ppo/default/seed-00")
SECOND = Path("push/gnn_ppo/default/seed-01")
BASELINE = Path("push/cma_es/default/seed-01")
LOWEST = Path("push/cma_es/default/seed-00")
RECORDS = {"cell.json", "curve.csv", "evaluation.csv", "metrics.csv"}

pytestmark = pytest.mark.skipif(not SCRIPT.exists(), reason="a source distribution leaves the results out")


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    """A results folder with four finished cells, as a run leaves them."""
    folder = tmp_path / "runs"
    for cell in (FIRST, SECOND, BASELINE, LOWEST):
        shutil.copytree(VERSION_0_1_0 / cell, folder / cell)
        for leftover in (CHECKPOINT_FILE, LOG_FILE, "cell.lock"):
            (folder / cell / leftover).write_bytes(b"left over")
    for cell in (BASELINE, LOWEST):
        shutil.copyfile(folder / FIRST / "policy.safetensors", folder / cell / "policy.safetensors")
    return folder


def ship(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Run the script as a maintainer does."""
    return subprocess.run([sys.executable, SCRIPT, *arguments], capture_output=True, text=True, check=False)


def files(folder: Path) -> set[str]:
    """Return the names of the files in a cell's folder."""
    return {path.name for path in folder.iterdir()}


def test_records_go_along_and_the_policies_that_are_shipped(runs: Path, tmp_path: Path) -> None:
    shipped = tmp_path / "shipped"
    assert ship(runs, shipped).returncode == 0
    assert files(shipped / FIRST) == files(shipped / SECOND) == {*RECORDS, "policy.safetensors"}
    assert files(shipped / LOWEST) == {*RECORDS, "policy.safetensors"}
    assert files(shipped / BASELINE) == RECORDS
    assert cb.load_results(shipped)["seed"].nunique() == 2
    cb.load_policy(shipped / SECOND)


def test_every_policy_goes_along_on_demand(runs: Path, tmp_path: Path) -> None:
    assert ship(runs, tmp_path / "shipped", "--policies", "all").returncode == 0
    assert files(tmp_path / "shipped" / BASELINE) == {*RECORDS, "policy.safetensors"}


def test_policies_stay_behind_on_demand(runs: Path, tmp_path: Path) -> None:
    assert ship(runs, tmp_path / "shipped", "--policies", "none").returncode == 0
    assert files(tmp_path / "shipped" / FIRST) == RECORDS


def test_tasks_go_along_one_by_one(runs: Path, tmp_path: Path) -> None:
    assert ship(runs, tmp_path / "shipped", "--task", "catch_balls", "scoop").stdout == "nothing new\n"
    assert len(ship(runs, tmp_path / "shipped", "--task", "scoop", "push").stdout.split()) == 4


def test_unfinished_cells_stay_and_go_when_they_are_done(runs: Path, tmp_path: Path) -> None:
    shipped = tmp_path / "shipped"
    record = CellRecord.read(runs / SECOND)
    assert record is not None
    replace(record, status=RUNNING).write(runs / SECOND)
    ship(runs, shipped)
    assert not (shipped / SECOND).exists()
    replace(record, status=DONE).write(runs / SECOND)
    assert ship(runs, shipped).stdout.split() == [str(shipped / SECOND)]


def test_what_is_there_is_never_replaced(runs: Path, tmp_path: Path) -> None:
    shipped = tmp_path / "shipped"
    ship(runs, shipped)
    before = (shipped / FIRST / "curve.csv").read_bytes()
    (runs / FIRST / "curve.csv").write_text("env_steps\n")
    assert ship(runs, shipped).stdout == "nothing new\n"
    assert (shipped / FIRST / "curve.csv").read_bytes() == before


def test_a_folder_that_is_not_there_is_one_line(tmp_path: Path) -> None:
    told = ship(tmp_path / "nowhere", tmp_path / "shipped")
    assert (told.returncode, told.stderr.count("\n")) == (2, 1)
    assert not (tmp_path / "shipped").exists()
