"""`codesign-bench reproduce`: an experiment without cells, and bad input."""

from __future__ import annotations

from pathlib import Path

import pytest

from codesign_bench.cli import main


def test_an_experiment_without_cells_ends_well_in_an_empty_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["reproduce", "hyperparameter_tables"]) == 0
    printed = capsys.readouterr().out
    assert "hyperparameter_tables.png" in printed
    assert "report left out: no results folder" in printed


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["figure_7"], "unknown figure 'figure_7'; choose from: task_gallery"),
        (["tradeoff", "--profile", "slow"], "unknown profile 'slow'; choose from: quick, laptop, workstation, paper"),
        (["tradeoff", "--seeds", "0"], "--seeds: expected an integer from 1 to 10,000, not '0'"),
        (["tradeoff", "--study", "neurips"], "unknown study 'neurips'"),
    ],
)
def test_bad_input_gets_one_line(capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    assert main(["reproduce", *arguments]) == 2
    assert message in capsys.readouterr().err
