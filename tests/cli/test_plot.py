"""`codesign-bench plot`: figures by their names or those of a study, and bad input answered in a line."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from builders import rising, store_cell
from codesign_bench.cli import main


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """Return a folder named `before` with the curve of one cell."""
    store_cell(tmp_path / "before", curve=rising(0.0, 1.0))
    return tmp_path / "before"


def test_curves_are_drawn_beside_those_that_they_are_compared_with(
    results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    store_cell(tmp_path / "now", curve=rising(0.0, 2.0), code={"commit": "a" * 40, "fingerprint": "1f"})
    out = tmp_path / "figures"
    arguments = ["--results", str(tmp_path / "now"), "--compare", str(results), "--out", str(out)]
    assert main(["plot", "learning_curves", *arguments]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert set(printed[2:]) == {str(path) for path in out.iterdir()}
    assert printed[0].startswith("These cells are not known to have been made alike")
    assert printed[1] == "commits: aaaaaaaaaaaa (1 cell of now), not recorded (1 cell of before)"
    table = pd.read_csv(out / "learning_curves.csv")
    ends = table[(table["quantity"] == "return_mean") & (table["env_steps"] == 100)].set_index("method")["mean"]
    assert ends.to_dict() == {"gnn_ppo": 2.0, "gnn_ppo from before": 1.0}


def test_an_unknown_study_is_answered_with_those_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plot", "--study", "neurips"]) == 2
    assert "unknown study 'neurips'; choose from: " in capsys.readouterr().err


def test_a_figure_without_curves_says_so(results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["plot", "tradeoff", "--results", str(results), "--compare", str(results), "--out", str(tmp_path)]
    assert main(arguments) == 2
    assert "choose from: learning_curves" in capsys.readouterr().err


@pytest.mark.parametrize("names", [[], ["learning_curves"]])
def test_a_folder_that_is_not_there_is_an_error_whatever_is_drawn(
    names: list[str], results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "figures"
    arguments = ["plot", *names, "--results", str(results), "--compare", str(tmp_path / "no"), "--out", str(out)]
    assert main(arguments) == 2
    assert f"no results folder '{tmp_path / 'no'}'" in capsys.readouterr().err
    assert not out.exists()


def test_plotting_without_results_says_how_to_make_some(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plot", "--results", str(tmp_path / "none"), "--out", str(tmp_path / "figures")]) == 2
    assert "codesign-bench run --method" in capsys.readouterr().err
