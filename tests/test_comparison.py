"""`plot --compare` draws other results over one's own: same colours, dashed, on the tasks that both have."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from codesign_bench.cli import main
from codesign_bench.figures.comparison import with_compared
from codesign_bench.registry import load_module
from codesign_bench.storage.results import load_results

REFERENCE = Path(__file__).resolve().parent.parent / "results" / "reference"

if not REFERENCE.is_dir():
    pytest.skip("a source distribution comes without results", allow_module_level=True)


@pytest.fixture(scope="module")
def own() -> pd.DataFrame:
    """Return curves of one's own on one task."""
    frame = load_results(REFERENCE)
    return frame[(frame["task"] == "push") & frame["method"].isin(["gnn_ppo", "cma_es"])]


def test_compared_curves_are_those_of_the_same_tasks(own: pd.DataFrame) -> None:
    both = with_compared(own, REFERENCE)
    added = both.iloc[len(own) :]
    assert set(both["task"]) == {"push"}
    assert set(added["method"]) == {f"{name} from reference" for name in load_results(REFERENCE)["method"]}
    pd.testing.assert_frame_equal(both.iloc[: len(own)], own.reset_index(drop=True))


def test_compared_curves_are_dashed_in_their_methods_colour(own: pd.DataFrame) -> None:
    figure = load_module("paper_figs", "learning_curves").draw(with_compared(own, REFERENCE))
    lines = {line.get_gid(): line for line in figure.axes[0].lines}
    ours, compared = lines["gnn_ppo"], lines["gnn_ppo from reference"]
    assert ours.get_color() == compared.get_color()
    assert (ours.get_linestyle(), compared.get_linestyle()) == ("-", "--")
    assert compared.get_ydata().tolist() == ours.get_ydata().tolist()
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert len(labels) == 7
    assert labels[-1].endswith("from reference (n=6)")


def test_a_figure_without_curves_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["plot", "tradeoff", "--results", str(REFERENCE), "--compare", str(REFERENCE), "--out", str(tmp_path)]
    assert main(arguments) == 2
    assert "choose from: learning_curves" in capsys.readouterr().err


@pytest.mark.parametrize("names", [[], ["learning_curves"]])
def test_a_folder_that_is_not_there_is_an_error_whatever_is_drawn(
    names: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "figures"
    arguments = ["plot", *names, "--results", str(REFERENCE), "--compare", str(tmp_path / "no"), "--out", str(out)]
    assert main(arguments) == 2
    assert f"no results folder '{tmp_path / 'no'}'" in capsys.readouterr().err
    assert not out.exists()
