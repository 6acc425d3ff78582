"""A grid of pictures of tools: where each stands, what marks an unsolved goal, how high the grid is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure, SubFigure

from codesign_bench.paper_figs._tool_grid import HEADER_HEIGHT, cut_alike, draw_grid, grid_height, is_map
from pictures import framed, picture, tool


def drawn(*rows: dict[str, Any]) -> tuple[SubFigure, dict[str, Axes]]:
    """Return the block into which these tools were drawn, and the axes of each picture by its name."""
    block = Figure().subfigures(1, 1)
    draw_grid(block, pd.DataFrame(list(rows)), "Push")
    return block, framed(block)


def test_a_picture_stands_in_its_row_and_column_and_fields_without_one_stay_empty() -> None:
    block, axes = drawn(tool("push", 0, 0), tool("push", 1, 1))
    assert set(axes) == {"instance 0", "instance 11"}
    top, bottom = (axes[name].get_position() for name in ("instance 0", "instance 11"))
    assert top.x1 <= bottom.x0
    assert top.y0 >= bottom.y1
    assert [axis.axison for axis in block.axes] == [True, False, False, True]


def test_a_map_is_labelled_by_both_entries_of_its_goals() -> None:
    block, axes = drawn(tool("push", 0, 0))
    words = {text.get_text() for text in block.findobj(lambda artist: hasattr(artist, "get_text"))}
    assert {"Push", r"goal x $\rightarrow$", r"goal y $\rightarrow$"} <= words
    assert axes["instance 0"].get_xlabel() == ""


def test_goals_of_one_entry_are_written_below_their_pictures() -> None:
    _, axes = drawn(tool("scoop", 0, 0, up=""), tool("scoop", 0, 1, up=""))
    assert [axis.get_xlabel() for axis in axes.values()] == ["goal x: 0 m", "goal x: 1 m"]


def test_an_unsolved_goal_has_a_frame_of_its_own() -> None:
    _, axes = drawn(tool("push", 0, 0), tool("push", 0, 1, success=0))
    solved, unsolved = (axes[name].spines["left"] for name in ("instance 0", "instance 1"))
    assert unsolved.get_linewidth() > 2 * solved.get_linewidth()
    assert to_hex(unsolved.get_edgecolor()) != to_hex(solved.get_edgecolor())


def test_the_pictures_of_a_task_are_cut_to_where_any_of_them_differs() -> None:
    pair = [picture(20, 20), picture(20, 60)]
    rows = [tool("push", 0, column, picture=pair[column]) for column in (0, 1)]
    frame = cut_alike(pd.DataFrame([rows[0], tool("scoop", 0, 0), rows[1]]))
    # 10 rows high and 50 columns wide, a margin of 5 on every side, and three quarters as high as wide.
    assert [shown.shape for shown in frame["picture"]] == [(45, 60, 3), (90, 120, 3), (45, 60, 3)]
    first, _, last = frame["picture"]
    assert np.flatnonzero((first == 0).any(axis=(0, 2))).tolist() == list(range(5, 15))
    assert np.flatnonzero((last == 0).any(axis=(0, 2))).tolist() == list(range(45, 55))


def test_the_height_of_a_grid_by_hand() -> None:
    # Pictures of 90 x 120 pixels, three side by side in 6 inches: 1.5 inches high, in two rows.
    grid = pd.DataFrame([tool("push", 0, 0), tool("push", 1, 2)])
    assert grid_height(grid, 6.0) == pytest.approx(2 * 1.5 + HEADER_HEIGHT)


def test_pictures_over_two_entries_make_a_map_and_over_one_a_row() -> None:
    assert is_map(pd.DataFrame([tool("push", 0, 0)]))
    assert not is_map(pd.DataFrame([tool("scoop", 0, 0, up="")]))
