"""Tools over the trade-off: one designer per alpha, over the same goals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from codesign_bench.errors import UserError
from codesign_bench.registry import load_module

tools: Any = load_module("paper_figs", "tradeoff_tools")


def tool(alpha: float, column: int, shade: int = 0) -> dict[str, Any]:
    """Return a picture's row; its picture has one grey pixel."""
    picture = np.full((30, 40, 3), 255, dtype=np.uint8)
    picture[10, 5 + column] = shade
    cell = {"task": "catch_balls", "title": "Catch balls", "method": "gnn_ppo", "label": "GNN-PPO", "seed": 0}
    place = {"row": 0, "column": column, "across": "landing x", "up": "", "goal": f"landing x: {column} m"}
    values = {"instance": column, "success": 1, "material": alpha, "picture": picture}
    return {**cell, "variant": f"alpha-{alpha:.2f}", "alpha": alpha, **place, **values}


def test_a_row_of_tools_per_alpha_from_low_to_high() -> None:
    frame = pd.DataFrame([tool(alpha, column) for alpha in (1.0, 0.3) for column in range(3)])
    drawn = tools.draw(frame)
    titles = [block.get_suptitle() for block in drawn.subfigs]
    assert [title.split("$")[1] for title in titles] == [r"\alpha", r"\alpha"]
    assert [title.split("= ")[1].split(";")[0] for title in titles] == ["0.3", "1"]
    assert all(len(block.axes) == 3 for block in drawn.subfigs)


def test_pictures_of_a_task_have_the_same_scale_whatever_alpha() -> None:
    frame = pd.DataFrame([tool(0.3, 0), tool(0.3, 1), tool(1.0, 0), tool(1.0, 30)])
    shapes = {axes.images[0].get_array().shape for axes in tools.draw(frame).axes if axes.images}
    assert len(shapes) == 1


def test_long_rows_are_thinned_evenly() -> None:
    table = tools.data(pd.DataFrame([tool(0.3, column) for column in range(11)]))
    assert table["instance"].tolist() == [0, 2, 4, 6, 8, 10]
    assert table["column"].tolist() == [0, 1, 2, 3, 4, 5]


def test_tools_without_an_alpha_say_so() -> None:
    with pytest.raises(UserError, match="no finished cell with an alpha"):
        tools.draw(pd.DataFrame([tool(0.3, 0)]).assign(variant="default"))
