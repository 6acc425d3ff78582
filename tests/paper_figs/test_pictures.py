"""Figures of pictures: what is cut off, where a tool stands, what marks an unsolved goal."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from codesign_bench.errors import UserError
from codesign_bench.paper_figs._pictures import Picture, cut_to_content, cut_to_differences
from codesign_bench.registry import load_module

tools: Any = load_module("paper_figs", "qualitative_tools")
gallery: Any = load_module("paper_figs", "task_gallery")


def picture(row: int, column: int, *, height: int = 90, width: int = 120) -> Picture:
    """Return a white picture with a black square of 10 pixels whose upper left corner is at row, column."""
    result = np.full((height, width, 3), 255, dtype=np.uint8)
    result[row : row + 10, column : column + 10] = 0
    return result


def tool(task: str, row: int, column: int, **values: Any) -> dict[str, Any]:
    """Return one picture's row, on a map of two goal entries unless `up` says otherwise."""
    return {
        **{"task": task, "title": task.title(), "method": "gnn_ppo", "label": "GNN-PPO", "variant": "default"},
        **{"alpha": np.nan, "seed": 3, "instance": 10 * row + column, "row": row, "column": column, "success": 1},
        **{"across": "goal x", "up": "goal y", "goal": f"goal x: {column} m", "picture": picture(10 * row, 30)},
        **values,
    }


def framed(figure: Figure) -> dict[str, Axes]:
    """Return the axes that hold pictures by their names."""
    return {str(axes.get_gid()): axes for axes in figure.axes if axes.images}


def test_pictures_are_cut_alike_to_where_they_differ() -> None:
    first, second = cut_to_differences([picture(20, 20), picture(20, 60)], aspect=1.0)
    # Squares from column 20 to 69; a margin of 4 % of 120, which is 5; as high as wide, within 90 rows.
    assert first.shape == second.shape == (60, 60, 3)
    assert np.flatnonzero((first == 0).any(axis=(0, 2))).tolist() == list(range(5, 15))
    assert np.flatnonzero((second == 0).any(axis=(0, 2))).tolist() == list(range(45, 55))


def test_equal_pictures_are_left_whole() -> None:
    assert cut_to_differences([picture(0, 0), picture(0, 0)])[0].shape == (90, 120, 3)


def test_a_single_picture_keeps_most_of_itself_and_all_of_its_content() -> None:
    cut = cut_to_content(picture(40, 55))
    assert cut.shape == (63, 84, 3)  # 70 % of both
    assert (cut == 0).sum() == 10 * 10 * 3


def test_a_high_picture_loses_top_and_bottom() -> None:
    high = np.zeros((100, 80, 3), dtype=np.uint8)
    high[0, 0] = 255
    assert cut_to_content(high, aspect=4 / 3).shape == (60, 80, 3)


def test_tools_stand_where_their_goals_lie() -> None:
    frame = pd.DataFrame([tool("push", 0, 0), tool("push", 0, 1), tool("push", 1, 1)])
    axes = framed(tools.draw(frame))
    at = {name: axis.get_position() for name, axis in axes.items()}
    assert set(at) == {"instance 0", "instance 1", "instance 11"}
    assert at["instance 0"].x0 < at["instance 1"].x0 == pytest.approx(at["instance 11"].x0)
    assert at["instance 1"].y0 > at["instance 11"].y0


def test_an_unsolved_goal_has_a_frame_of_its_own() -> None:
    axes = framed(tools.draw(pd.DataFrame([tool("push", 0, 0), tool("push", 0, 1, success=0)])))
    solved, unsolved = (axes[name].spines["left"] for name in ("instance 0", "instance 1"))
    assert unsolved.get_linewidth() > 2 * solved.get_linewidth()
    assert to_hex(unsolved.get_edgecolor()) != to_hex(solved.get_edgecolor())


def test_a_grid_names_task_designer_and_seed() -> None:
    figure = tools.draw(pd.DataFrame([tool("push", 0, 0), tool("scoop", 0, 0, up="")]))
    assert {text.get_text() for text in figure.findobj(lambda artist: hasattr(artist, "get_text"))} >= {
        "Push: GNN-PPO, seed 3",
        "Scoop: GNN-PPO, seed 3",
    }


def test_goals_of_one_entry_are_written_below_their_pictures() -> None:
    axes = framed(tools.draw(pd.DataFrame([tool("scoop", 0, 0, up=""), tool("scoop", 0, 1, up="")])))
    assert [axis.get_xlabel() for axis in axes.values()] == ["goal x: 0 m", "goal x: 1 m"]


def test_other_variants_are_left_out_and_tables_hold_no_pictures() -> None:
    frame = pd.DataFrame([tool("scoop", 0, 0), tool("push", 0, 0), tool("push", 0, 1, variant="alpha-0.30")])
    table = tools.data(frame)
    assert table["task"].tolist() == ["push", "scoop"]
    assert not {"picture", "alpha"} & set(table.columns)
    with pytest.raises(UserError, match="no finished cell of variant 'default'"):
        tools.data(frame[frame["variant"] != "default"])
    with pytest.raises(UserError, match="lack the column goal"):
        tools.draw(frame.drop(columns="goal"))


def scene(task: str) -> dict[str, Any]:
    """Return one task's row of the gallery."""
    values = {"instance": 0, "step": 6, "steps": 10, "return": 1.0, "success": 1, "picture": picture(40, 55)}
    return {"task": task, "title": task.title(), **values}


def test_the_gallery_has_one_titled_picture_per_task_in_the_papers_order() -> None:
    figure = gallery.draw(pd.DataFrame([scene(task) for task in ("other", "scoop", "push", "fetch_cube")]))
    titles = [axis.get_title() for axis in figure.axes if axis.images]
    assert titles == ["Push", "Scoop", "Fetch_Cube", "Other"]
    (shown, *_) = [axis.images[0].get_array() for axis in figure.axes if axis.images]
    assert np.array_equal(shown, cut_to_content(picture(40, 55)))


def test_a_gallery_without_pictures_is_refused() -> None:
    with pytest.raises(UserError, match="have no rows"):
        gallery.data(pd.DataFrame([scene("push")]).iloc[:0])
    with pytest.raises(UserError, match="lack the column steps"):
        gallery.draw(pd.DataFrame([scene("push")]).drop(columns="steps"))
