"""Compared curves are those of the same tasks: in their methods' colours, dashed."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from builders import rising, store_cell
from codesign_bench.figures.comparison import made_otherwise, with_compared
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


def test_how_compared_cells_were_made_otherwise_is_told_of_shared_tasks(tmp_path: Path) -> None:
    for name, commit in (("now", "a" * 40), ("before", "b" * 40)):
        store_cell(tmp_path / name, code={"commit": commit, "fingerprint": commit})
    store_cell(tmp_path / "before", task="scoop", code={"commit": "c" * 40, "fingerprint": "3f"})
    _, line = made_otherwise(tmp_path / "now", tmp_path / "before")
    assert line == "commits: aaaaaaaaaaaa (1 cell of now), bbbbbbbbbbbb (1 cell of before)"


def test_two_folders_of_one_name_are_told_apart_by_their_paths(tmp_path: Path) -> None:
    for folder in ("one", "two"):
        store_cell(tmp_path / folder / "runs", code={"commit": folder, "fingerprint": folder})
    _, line = made_otherwise(tmp_path / "one" / "runs", tmp_path / "two" / "runs")
    assert str(tmp_path / "two" / "runs") in line
