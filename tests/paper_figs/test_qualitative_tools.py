"""Tools over goals: where each stands, what marks an unsolved goal, and what is left out."""

from __future__ import annotations

from typing import Any

import pandas as pd
import pytest

from codesign_bench.errors import UserError
from codesign_bench.registry import load_module
from pictures import framed, tool

tools: Any = load_module("paper_figs", "qualitative_tools")


def test_tools_stand_where_their_goals_lie() -> None:
    frame = pd.DataFrame([tool("push", 0, 0), tool("push", 0, 1), tool("push", 1, 1)])
    axes = framed(tools.draw(frame))
    at = {name: axis.get_position() for name, axis in axes.items()}
    assert set(at) == {"instance 0", "instance 1", "instance 11"}
    assert at["instance 0"].x0 < at["instance 1"].x0 == pytest.approx(at["instance 11"].x0)
    assert at["instance 1"].y0 > at["instance 11"].y0


def test_a_grid_names_task_designer_and_seed() -> None:
    figure = tools.draw(pd.DataFrame([tool("push", 0, 0), tool("scoop", 0, 0, up="")]))
    assert {text.get_text() for text in figure.findobj(lambda artist: hasattr(artist, "get_text"))} >= {
        "Push: GNN-PPO, seed 3",
        "Scoop: GNN-PPO, seed 3",
    }


def test_other_variants_are_left_out_and_tables_hold_no_pictures() -> None:
    frame = pd.DataFrame([tool("scoop", 0, 0), tool("push", 0, 0), tool("push", 0, 1, variant="alpha-0.30")])
    table = tools.data(frame)
    assert table["task"].tolist() == ["push", "scoop"]
    assert not {"picture", "alpha"} & set(table.columns)
    with pytest.raises(UserError, match="no finished cell of variant 'default'"):
        tools.data(frame[frame["variant"] != "default"])
    with pytest.raises(UserError, match="lack the column goal"):
        tools.draw(frame.drop(columns="goal"))
