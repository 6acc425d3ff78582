"""A results folder is marked, a foreign one is left alone, and what a killed process leaves is swept."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from codesign_bench.errors import UserError
from codesign_bench.storage.layout import (
    LAYOUT_SCHEMA,
    MARKER_FILE,
    WHILE_RUNNING,
    is_marked,
    open_folder,
    sweep_leftovers,
    write_rows,
)
from codesign_bench.storage.locks import locked


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


@pytest.mark.parametrize(
    "leftover", [f".{MARKER_FILE}-x.partial", ".reference_points.csv-abc_1.partial", ".nfs0000001", "lost+found"]
)
def test_what_a_killed_process_or_the_system_leaves_is_not_foreign(tmp_path: Path, leftover: str) -> None:
    (tmp_path / leftover).write_text("")
    open_folder(tmp_path)
    assert is_marked(tmp_path)
    assert not list(tmp_path.glob(f".{MARKER_FILE}-*"))


def test_a_marker_that_was_left_empty_is_completed_and_a_complete_one_stays(tmp_path: Path) -> None:
    (tmp_path / MARKER_FILE).write_text("")
    open_folder(tmp_path)
    assert json.loads((tmp_path / MARKER_FILE).read_text())["schema"] == LAYOUT_SCHEMA
    (tmp_path / MARKER_FILE).write_text('{"schema": 1, "of": "a later version"}')
    open_folder(tmp_path)
    assert "later version" in (tmp_path / MARKER_FILE).read_text()


def test_a_folder_that_another_process_marks_and_fills_meanwhile_is_ours(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks = []

    def first_look_sees_nothing(folder: Path) -> bool:
        looks.append(folder)
        if len(looks) == 1:
            (folder / "push").mkdir()
            (folder / MARKER_FILE).write_text("{}")
            return False
        return is_marked(folder)

    monkeypatch.setattr("codesign_bench.storage.layout.is_marked", first_look_sees_nothing)
    open_folder(tmp_path)
    assert len(looks) == 2


def test_leftovers_of_a_finished_cell_are_swept_unless_a_process_holds_its_lock(tmp_path: Path) -> None:
    kept = ("cell.json", "curve.csv", "notes.txt")
    large = "checkpoint.large-3.npz"
    for name in (*kept, *WHILE_RUNNING, large, ".curve.csv-abc.partial"):
        (tmp_path / name).write_text("")
    with locked(tmp_path):
        sweep_leftovers(tmp_path)
        assert len(list(tmp_path.iterdir())) == len(kept) + len(WHILE_RUNNING) + 2
    sweep_leftovers(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == set(kept)


def test_a_leftover_that_cannot_be_removed_stays(tmp_path: Path) -> None:
    (tmp_path / "progress.json").mkdir()
    sweep_leftovers(tmp_path)
    assert (tmp_path / "progress.json").is_dir()


def test_floats_survive_the_table(tmp_path: Path) -> None:
    value = 0.1 + 0.2
    write_rows(tmp_path / "table.csv", [{"value": value}])
    assert float((tmp_path / "table.csv").read_text().split()[1]) == value
