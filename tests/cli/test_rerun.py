"""`codesign-bench rerun CELL` runs the cell of a `cell.json` again, or says what it would do."""

from __future__ import annotations

from pathlib import Path

import pytest

from builders import sweep, toy_cells
from codesign_bench.cli import main

pytestmark = pytest.mark.usefixtures("toy")


def test_a_dry_run_writes_nothing_and_a_run_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (cell,) = toy_cells()
    assert sweep([cell], tmp_path / "runs")[0] == 0
    line = ["rerun", str(cell.folder(tmp_path / "runs")), "--out", str(tmp_path / "again"), "--jobs", "1"]
    assert main([*line, "--dry-run"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "nothing was run"
    assert not (tmp_path / "again").exists()
    assert main(line) == 0
    assert "the same curve as before" in capsys.readouterr().out


def test_what_is_no_cell_is_refused_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["rerun", str(tmp_path), "--out", str(tmp_path / "again")]) == 2
    assert capsys.readouterr().err.splitlines() == [f"codesign-bench: '{tmp_path}' is not a cell folder (no cell.json)"]
