"""`codesign-bench pack`: one archive, which every other command reads."""

from __future__ import annotations

from pathlib import Path

import pytest

from builders import rising, store_cell
from codesign_bench.cli import main


def test_an_archive_takes_the_place_of_its_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    runs, out = tmp_path / "runs", tmp_path / "mine.zip"
    store_cell(runs, curve=rising(0.0, 1.0))
    assert main(["pack", str(runs), "--out", str(out)]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed[0].startswith("1 cells, 0 policies, 3 files, ")
    assert printed[0].endswith("all checked")
    assert printed[1] == str(out)
    assert main(["pack", str(runs), "--out", str(out)]) == 2
    assert "no archive is replaced" in capsys.readouterr().err

    assert main(["status", "--results", str(out)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "1 cells: 1 done"
    figures = tmp_path / "figures"
    compared = ["plot", "learning_curves", "--results", str(runs), "--compare", str(out), "--out", str(figures)]
    assert main(compared) == 0
    assert "gnn_ppo from mine" in (figures / "learning_curves.csv").read_text()
    assert main(["verify", "--results", str(out), "--out", str(tmp_path / "claims")]) == 0
    assert '"results": "mine"' in (tmp_path / "claims" / "claims.json").read_text()
    capsys.readouterr()
    assert main(["verify", "--results", str(out), "--out", str(tmp_path / "claims"), "--measure"]) == 2
    assert "only read" in capsys.readouterr().err


def test_a_damaged_archive_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.zip").write_bytes(b"no zip file")
    for command in (
        ["status", "--results"],
        ["plot", "--compare"],
        ["compare", str(tmp_path)],
        ["pack", "--out=x.zip"],
    ):
        assert main([*command, str(tmp_path / "mine.zip")]) == 2
        assert "mine.zip" in capsys.readouterr().err


def test_commands_that_measure_do_not_take_the_name_of_shipped_results(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reference", "--task", "push", "--results", "reference"]) == 2
    assert "only read" in capsys.readouterr().err
