"""Results are read as one tidy frame, whatever else lies in the folder."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from codesign_bench import load_policy, load_results
from codesign_bench.cell.cell import grid
from codesign_bench.errors import UserError
from codesign_bench.storage.results import (
    CURVE_COLUMNS,
    MARKER_FILE,
    cell_lock,
    cell_status,
    is_locked,
    open_folder,
    read_cell,
    write_cell,
    write_rows,
)


def make_cell(out: Path, method: str, seed: int, evaluations: int, **changes: Any) -> Path:
    """Write a cell with a short curve below `out` and return its folder."""
    content = {
        "status": "done",
        "task": "push",
        "method": method,
        "variant": "default",
        "cutout": None,
        "alpha": None,
        "seed": seed,
        "config": {},
        **changes,
    }
    folder = out / "push" / method / str(content["variant"]) / f"seed-{seed:02d}"
    folder.mkdir(parents=True)
    write_cell(folder, content)
    rows = [dict.fromkeys(CURVE_COLUMNS, 0.5) | {"env_steps": 100 * row} for row in range(evaluations)]
    write_rows(folder / "curve.csv", rows, CURVE_COLUMNS)
    return folder


def test_each_row_tells_its_cell(tmp_path: Path) -> None:
    make_cell(tmp_path, "one", 0, 3)
    make_cell(tmp_path, "two", 4, 2, variant="cutout-0.40", cutout=0.4, label="Second")
    frame = load_results(tmp_path)
    cells = ["task", "method", "variant", "cutout", "alpha", "seed"]
    assert list(frame.columns) == [*cells, "label", *CURVE_COLUMNS]
    assert frame["method"].tolist() == ["one"] * 3 + ["two"] * 2
    assert frame["label"].tolist() == ["one"] * 3 + ["Second"] * 2
    assert frame["seed"].tolist() == [0, 0, 0, 4, 4]
    assert frame["env_steps"].tolist() == [0, 100, 200, 0, 100]
    assert frame["cutout"].isna().tolist() == [True] * 3 + [False] * 2
    assert frame["alpha"].isna().all()


def test_partial_sweeps_and_foreign_files_do_not_matter(tmp_path: Path) -> None:
    make_cell(tmp_path, "one", 0, 3)
    make_cell(tmp_path, "one", 1, 0, status="running")
    (make_cell(tmp_path, "one", 2, 2) / "curve.csv").unlink()
    (make_cell(tmp_path, "one", 3, 2) / "curve.csv").write_text("somebody,else\n1,2\n")
    (make_cell(tmp_path, "one", 4, 2) / "cell.json").write_text("{")
    (make_cell(tmp_path, "one", 5, 2) / "cell.json").write_text("[1]")
    (tmp_path / "notes.txt").write_text("mine")
    assert load_results(str(tmp_path))["seed"].unique().tolist() == [0]


def test_a_missing_or_empty_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="nowhere"):
        load_results(tmp_path / "nowhere")
    with pytest.raises(UserError, match="no results"):
        load_results(tmp_path)


def test_a_results_folder_is_marked_and_a_foreign_one_left_alone(tmp_path: Path) -> None:
    open_folder(tmp_path / "new" / "runs")
    assert json.loads((tmp_path / "new" / "runs" / MARKER_FILE).read_text())["schema"] == 1
    open_folder(tmp_path / "new" / "runs")
    foreign = tmp_path / "thesis"
    foreign.mkdir()
    (foreign / "chapter.tex").write_text("")
    with pytest.raises(UserError, match="thesis"):
        open_folder(foreign)
    assert [path.name for path in foreign.iterdir()] == ["chapter.tex"]


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="file/runs: cannot write there"):
        open_folder(tmp_path / "file" / "runs")


def test_a_damaged_cell_file_is_named(tmp_path: Path) -> None:
    folder = make_cell(tmp_path, "one", 0, 1)
    (folder / "cell.json").write_text('{"status": "do')
    with pytest.raises(UserError, match=r"cell\.json.*delete its folder"):
        read_cell(folder)


def test_a_running_cell_that_nobody_runs_is_interrupted(tmp_path: Path) -> None:
    content = {"status": "running"}
    assert cell_status(tmp_path, content) == "interrupted"
    with cell_lock(tmp_path):
        assert is_locked(tmp_path)
        assert cell_status(tmp_path, content) == "running"
    assert cell_status(tmp_path, content) == "interrupted"
    assert cell_status(tmp_path, {"status": "done"}) == "done"


def test_floats_survive_the_table(tmp_path: Path) -> None:
    value = 0.1 + 0.2
    write_rows(tmp_path / "table.csv", [{"value": value}])
    assert float((tmp_path / "table.csv").read_text().split()[1]) == value


@pytest.mark.parametrize(("status", "named"), [("done", "policy file is missing"), ("running", "'running'")])
def test_a_cell_without_a_policy_says_so(tmp_path: Path, status: str, named: str) -> None:
    with pytest.raises(UserError, match=named):
        load_policy(make_cell(tmp_path, "one", 0, 1, status=status))
    with pytest.raises(UserError, match="no cell's folder"):
        load_policy(tmp_path)


@pytest.mark.usefixtures("toy")
def test_evaluations_hold_every_instance_of_every_finished_cell(tmp_path: Path) -> None:
    from codesign_bench.storage.results import load_evaluations
    from codesign_bench.sweep.runner import run_sweep

    cells = list(grid(tasks=["toy_reach"], methods=["toy_search"], seeds=range(2), cutouts=[0.5], steps=100))
    run_sweep(cells, tmp_path, console=Console(quiet=True))
    frame = load_evaluations(tmp_path)
    assert len(frame) == 2 * 8
    assert frame.groupby("seed")["instance"].apply(list).tolist() == [list(range(8))] * 2
    assert frame["cutout"].eq(0.5).all()
    assert (frame["in_cutout"] == (frame["instance_goal"] < 0.5)).all()
    with pytest.raises(UserError, match="no finished cell"):
        load_evaluations(tmp_path / "toy_reach")
