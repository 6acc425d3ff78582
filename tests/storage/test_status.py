"""How far a cell is, as a line of text."""

from __future__ import annotations

from pathlib import Path

from builders import rising, store_cell
from codesign_bench.config.settings import Sourced, StoredConfig
from codesign_bench.storage.cells import open_cell
from codesign_bench.storage.records import RUNNING
from codesign_bench.storage.status import status_row

LONG = StoredConfig(run={"steps": Sourced(1_000_000, "default")})


def test_a_finished_cell_is_told_with_its_last_evaluation(tmp_path: Path) -> None:
    curve = [{**row, "success_rate": 0.5} for row in rising(0.0, -1.234, every=2_500)]
    cell = open_cell(store_cell(tmp_path, curve=curve, env_steps=2_504))
    assert status_row(tmp_path, cell) == ("push/gnn_ppo/default/seed-00", "done", "2,504", "1,000", "-1.23", "0.50")


def test_an_interrupted_cell_is_as_far_as_its_last_evaluation(tmp_path: Path) -> None:
    cell = open_cell(store_cell(tmp_path, status=RUNNING, curve=rising(0.0, 2.0), config=LONG))
    assert status_row(tmp_path, cell)[1:] == ("interrupted", "100", "1,000,000", "2.00", "0.00")


def test_a_cell_that_was_never_evaluated_has_no_numbers(tmp_path: Path) -> None:
    cell = open_cell(store_cell(tmp_path, status=RUNNING))
    assert status_row(tmp_path, cell)[2:] == ("0", "1,000", "", "")
