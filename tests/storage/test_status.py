"""How far a cell is, as a line of text."""

from __future__ import annotations

from pathlib import Path

from builders import rising, store_cell
from codesign_bench.config.settings import Sourced, StoredConfig
from codesign_bench.storage.cells import open_cell
from codesign_bench.storage.files import write_json
from codesign_bench.storage.layout import PROGRESS_FILE
from codesign_bench.storage.locks import locked
from codesign_bench.storage.records import RUNNING
from codesign_bench.storage.status import env_steps_of, read_progress, status_row

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


TOLD = {"updated": 5.0, "env_steps": 70, "steps": 1_000, "steps_per_second": 3.0}


def test_a_running_cell_is_as_far_as_its_process_tells(tmp_path: Path) -> None:
    folder = store_cell(tmp_path, status=RUNNING, curve=rising(0.0))
    write_json(folder / PROGRESS_FILE, TOLD)
    with locked(folder):
        assert env_steps_of(open_cell(folder)) == 70
    assert env_steps_of(open_cell(folder)) == 0  # it was interrupted, and resumes from its last evaluation


def test_what_a_process_told_long_ago_or_in_another_form_is_nothing(tmp_path: Path) -> None:
    write_json(tmp_path / PROGRESS_FILE, TOLD)
    assert read_progress(tmp_path) == TOLD
    assert read_progress(tmp_path, since=6.0) is None
    write_json(tmp_path / PROGRESS_FILE, {**TOLD, "steps": "many"})
    assert read_progress(tmp_path) is None
    assert read_progress(tmp_path / "nowhere") is None
