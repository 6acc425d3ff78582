"""`codesign-bench compare`: a table of differences, and lines on what differs besides the results."""

from __future__ import annotations

from pathlib import Path

import pytest

from builders import rising, store_cell
from codesign_bench.cli import main


def test_two_folders_are_compared(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, more in (("now", 1.0), ("before", 0.0)):
        for seed in range(3):
            code = {"commit": name * 10, "fingerprint": name}
            store_cell(tmp_path / name, seed=seed, curve=rising(0.0, more + 0.1 * seed), code=code)
    assert main(["compare", str(tmp_path / "now"), str(tmp_path / "before")]) == 0
    header, row, *notes = capsys.readouterr().out.splitlines()
    assert header.split()[:2] == ["task", "method"]
    assert header.endswith("adjusted p")
    assert row.split()[:8] == ["push", "gnn_ppo", "3,", "3", "1.10", "0.10", "+1.00", "[+0.77,"]
    assert main(["compare", str(tmp_path / "now"), str(tmp_path / "before"), "--method", "all"]) == 0
    assert capsys.readouterr().out.splitlines() == [header, row, *notes]
    assert notes[-1].startswith("commits: ")
    assert "of now" in notes[-1]


def test_bad_input_is_told_in_a_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    store_cell(tmp_path / "now")
    for other, word in (("nowhere", "no results folder"), ("no.zip", "no archive")):
        assert main(["compare", str(tmp_path / "now"), str(tmp_path / other)]) == 2
        assert word in capsys.readouterr().err
    assert main(["compare", str(tmp_path / "now"), str(tmp_path / "now"), "--method", "no_such_name"]) == 2
    assert "--method" in capsys.readouterr().err
