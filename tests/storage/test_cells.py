"""The cells of a results folder: found in order, whatever else lies there, each with its status."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from builders import BUDGET, VERSION_0_1_0, rising, store_cell
from codesign_bench.cell.cell import Cell
from codesign_bench.config.settings import Sourced, StoredConfig
from codesign_bench.errors import UserError
from codesign_bench.storage.cells import find_cells, open_cell, reported_cells, scan, stored_record
from codesign_bench.storage.locks import locked
from codesign_bench.storage.reading import DamagedFile
from codesign_bench.storage.records import RUNNING


def test_cells_are_found_in_order_and_what_cannot_be_read_is_passed_over(tmp_path: Path) -> None:
    for seed in (1, 0):
        store_cell(tmp_path, seed=seed)
    (store_cell(tmp_path, seed=2) / "cell.json").write_text("{")
    (tmp_path / "notes.txt").write_text("mine")
    assert [cell.record.seed for cell in find_cells(tmp_path)] == [0, 1]
    (problem,) = scan(tmp_path).unusable
    assert problem.path == tmp_path / "push" / "gnn_ppo" / "default" / "seed-02" / "cell.json"


def test_a_copy_in_another_cells_folder_is_told_and_does_not_count(tmp_path: Path) -> None:
    folder = store_cell(tmp_path)
    for copy in ("seed-07", "Copy of seed-00"):
        shutil.copytree(folder, folder.parent / copy)
    contents = scan(tmp_path)
    assert [cell.folder for cell in contents.cells] == [folder]
    assert {problem.path.parent.name for problem in contents.unusable} == {"seed-07", "Copy of seed-00"}
    assert {problem.reason for problem in contents.unusable} == {
        "it is that of the cell push/gnn_ppo/default/seed-00, so it is a copy and does not count"
    }
    with pytest.raises(DamagedFile, match="is a copy"):
        stored_record(Cell("push", "gnn_ppo", 7), tmp_path)
    assert open_cell(folder.parent / "seed-07").record.seed == 0, "a single cell may be anywhere"


def test_a_folder_with_a_cells_files_but_no_cell_file_is_told(tmp_path: Path) -> None:
    (store_cell(tmp_path) / "cell.json").unlink()
    (tmp_path / "push" / "gnn_ppo" / "default" / "seed-01").write_text("")
    (tmp_path / "figures" / "a" / "b" / "c").mkdir(parents=True)
    assert [problem.reason for problem in scan(tmp_path).unusable] == [
        "it is missing, although the folder has a cell's files",
        "it is not a folder",
    ]


@pytest.mark.parametrize("name", ["curve.csv", "evaluation.csv"])
def test_a_finished_cell_without_its_files_is_damaged(tmp_path: Path, name: str) -> None:
    folder = store_cell(tmp_path)
    (folder / name).unlink()
    cell = open_cell(folder)
    assert cell.status == "damaged"
    assert [str(problem) for problem in cell.problems] == [
        f"cannot read {folder / name} (it is missing, although the cell is done)"
    ]


def test_a_running_cell_lacks_nothing(tmp_path: Path) -> None:
    cell = open_cell(store_cell(tmp_path, status=RUNNING))
    assert (cell.curve(), cell.evaluation(), cell.problems) == (None, None, [])


@pytest.mark.parametrize("name", ["curve.csv", "evaluation.csv"])
def test_a_changed_number_of_a_finished_cell_is_found(tmp_path: Path, name: str) -> None:
    path = store_cell(tmp_path, curve=rising(0.0, 2.5)) / name
    path.write_text(path.read_text().replace("2.5", "2.6"))
    (problem,) = open_cell(path.parent).problems
    assert (problem.path, problem.reason) == (path, "its checksum does not match")


def test_a_cell_of_an_earlier_version_has_no_checksums_but_an_evaluation_that_fits_its_curve(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(VERSION_0_1_0 / "push" / "gnn_ppo" / "default" / "seed-00", tmp_path / "cell"))
    assert open_cell(folder).status == "done"
    path = folder / "evaluation.csv"
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:-1]))
    (problem,) = open_cell(folder).problems
    assert "that of the last row of curve.csv" in problem.reason


def test_a_damaged_policy_is_among_what_cannot_be_used(tmp_path: Path) -> None:
    folder = store_cell(tmp_path)
    (folder / "policy.safetensors").write_bytes(b"\x80\x04")
    cell = open_cell(folder)
    assert (cell.status, cell.problems[0].path.name) == ("damaged", "policy.safetensors")


def test_a_running_cell_that_nobody_runs_is_interrupted(tmp_path: Path) -> None:
    folder = store_cell(tmp_path, status=RUNNING)
    assert open_cell(folder).status == "interrupted"
    with locked(folder):
        assert open_cell(folder).status == "running"
    assert open_cell(folder).status == "interrupted"
    assert open_cell(store_cell(tmp_path, seed=1)).status == "done"


def test_the_last_evaluation_is_the_last_row_of_the_curve(tmp_path: Path) -> None:
    last = open_cell(store_cell(tmp_path, curve=rising(0.5, 2.5))).last_evaluation()
    assert (last["env_steps"], last["return_mean"]) == (100.0, 2.5)
    assert open_cell(store_cell(tmp_path, seed=1, status=RUNNING)).last_evaluation() == {}


def test_cells_that_were_evaluated_on_validation_instances_are_not_reported(tmp_path: Path) -> None:
    store_cell(tmp_path, seed=0)  # as cells before there were validation instances
    for seed, instances in ((1, "evaluation"), (2, "validation")):
        run = {**BUDGET.run, "instances": Sourced(instances, "variant")}
        store_cell(tmp_path, seed=seed, config=StoredConfig(run=run, method=BUDGET.method))
    assert [cell.record.seed for cell in find_cells(tmp_path)] == [0, 1, 2]
    assert [cell.record.seed for cell in reported_cells(tmp_path)] == [0, 1]


def test_a_folder_that_is_missing_or_no_cell_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no results folder"):
        list(find_cells(tmp_path / "nowhere"))
    with pytest.raises(UserError, match=r"is not a cell folder \(no cell\.json\)"):
        open_cell(tmp_path)
