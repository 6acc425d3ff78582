"""A results folder is marked, a foreign one is left alone, and a running cell holds a lock."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from codesign_bench.errors import UserError
from codesign_bench.storage.layout import LAYOUT_SCHEMA, MARKER_FILE, cell_lock, is_locked, open_folder, write_rows


def test_a_results_folder_is_marked_and_a_foreign_one_left_alone(tmp_path: Path) -> None:
    open_folder(tmp_path / "new" / "runs")
    assert json.loads((tmp_path / "new" / "runs" / MARKER_FILE).read_text())["schema"] == LAYOUT_SCHEMA
    open_folder(tmp_path / "new" / "runs")
    foreign = tmp_path / "thesis"
    foreign.mkdir()
    (foreign / "chapter.tex").write_text("")
    with pytest.raises(UserError, match="thesis"):
        open_folder(foreign)
    assert [path.name for path in foreign.iterdir()] == ["chapter.tex"]


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="file/runs: not writable"):
        open_folder(tmp_path / "file" / "runs")


def test_a_lock_is_seen_while_it_is_held(tmp_path: Path) -> None:
    assert not is_locked(tmp_path)
    with cell_lock(tmp_path):
        assert is_locked(tmp_path)
    assert not is_locked(tmp_path)


def test_floats_survive_the_table(tmp_path: Path) -> None:
    value = 0.1 + 0.2
    write_rows(tmp_path / "table.csv", [{"value": value}])
    assert float((tmp_path / "table.csv").read_text().split()[1]) == value
