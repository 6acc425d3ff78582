"""`plot --compare` draws other results over one's own: same colours, dashed, on the tasks that both have."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from builders import rising, store_cell
from codesign_bench.cli import main
from codesign_bench.figures.comparison import with_compared
from codesign_bench.registry import load_module
from codesign_bench.storage.frames import load_results


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """Return a folder named `before` with three seeds of two methods on one task, and one cell of another task."""
    folder = tmp_path / "before"
    for seed in range(3):
        store_cell(folder, method="gnn_ppo", seed=seed, curve=rising(0.0, 1.0 + seed))
        store_cell(folder, method="cma_es", seed=seed, curve=rising(0.0, 0.5 + seed))
    store_cell(folder, task="scoop", curve=rising(0.0, 9.0))
    return folder


@pytest.fixture
def own(results: Path) -> pd.DataFrame:
    """Return the curves of one method on one task."""
    frame = load_results(results)
    return frame[(frame["task"] == "push") & (frame["method"] == "gnn_ppo")]


def test_compared_curves_are_those_of_the_same_tasks(own: pd.DataFrame, results: Path) -> None:
    both = with_compared(own, results)
    added = both.iloc[len(own) :]
    assert set(both["task"]) == {"push"}
    assert set(added["method"]) == {"gnn_ppo from before", "cma_es from before"}
    pd.testing.assert_frame_equal(both.iloc[: len(own)], own.reset_index(drop=True))


def test_compared_curves_are_dashed_in_their_methods_colour(own: pd.DataFrame, results: Path) -> None:
    figure = load_module("paper_figs", "learning_curves").draw(with_compared(own, results))
    lines = {line.get_gid(): line for line in figure.axes[0].lines}
    ours, compared = lines["gnn_ppo"], lines["gnn_ppo from before"]
    assert ours.get_color() == compared.get_color()
    assert (ours.get_linestyle(), compared.get_linestyle()) == ("-", "--")
    assert compared.get_ydata().tolist() == ours.get_ydata().tolist()
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert len(labels) == 3
    assert labels[-1].endswith("from before (n=3)")


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
