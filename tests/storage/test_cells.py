"""The cells of a results folder: found in order, whatever else lies there, each with its status."""

from __future__ import annotations

from pathlib import Path

import pytest

from builders import BUDGET, rising, store_cell
from codesign_bench.config.settings import Sourced, StoredConfig
from codesign_bench.errors import UserError
from codesign_bench.storage.cells import find_cells, open_cell, reported_cells
from codesign_bench.storage.locks import locked
from codesign_bench.storage.records import RUNNING


def test_cells_are_found_in_order_and_what_cannot_be_read_is_passed_over(tmp_path: Path) -> None:
    for seed in (1, 0):
        store_cell(tmp_path, seed=seed)
    (store_cell(tmp_path, seed=2) / "cell.json").write_text("{")
    (tmp_path / "notes.txt").write_text("mine")
    assert [cell.record.seed for cell in find_cells(tmp_path)] == [0, 1]


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
    assert open_cell(store_cell(tmp_path, seed=1)).last_evaluation() == {}


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
