"""The figures of the trade-off: ratio and its parts by hand, and tools of one designer per alpha."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.container import ErrorbarContainer

from codesign_bench.errors import UserError
from codesign_bench.registry import load_module

figure: Any = load_module("paper_figs", "tradeoff")
tools: Any = load_module("paper_figs", "tradeoff_tools")


def evaluations(
    alpha: float, effort: list[float], *, method: str = "gnn_ppo", task: str = "catch_balls"
) -> pd.DataFrame:
    """Return two evaluation instances per seed that use 0.2 and 0.6 of the material; `effort` is given per seed."""
    rows = [
        (task, method, method.upper(), f"alpha-{alpha:.2f}", alpha, seed, material, value)
        for seed, value in enumerate(effort)
        for material in (0.2, 0.6)
    ]
    return pd.DataFrame(rows, columns=["task", "method", "label", "variant", "alpha", "seed", "material", "effort"])


def test_the_numbers_by_hand() -> None:
    table = figure.data(evaluations(0.3, [0.1, 0.2, 0.4])).set_index("quantity")
    # Material 0.4 over efforts 0.1, 0.2 and 0.4: ratios 4, 2 and 1.
    assert table.loc["ratio", "mean"] == pytest.approx(7 / 3)
    assert table.loc["ratio", "standard_error"] == pytest.approx(np.std([4, 2, 1], ddof=1) / np.sqrt(3))
    assert table.loc["material", ["mean", "standard_error"]].tolist() == pytest.approx([0.4, 0.0])
    assert table.loc["effort", "mean"] == pytest.approx(0.7 / 3)
    assert set(table["seeds"]) == {3}


def test_no_interval_below_three_seeds() -> None:
    assert figure.data(evaluations(0.3, [0.1, 0.2]))["standard_error"].isna().all()


def test_where_nothing_moves_there_is_no_ratio() -> None:
    table = figure.data(evaluations(0.0, [0.0])).set_index("quantity")
    assert np.isnan(table.loc["ratio", "mean"])
    assert table.loc["material", "mean"] == pytest.approx(0.4)


def test_a_line_per_method_over_alpha() -> None:
    cells = [evaluations(1.0, [0.4]), evaluations(0.0, [0.1]), evaluations(0.0, [0.2], method="cma_rl")]
    drawn = figure.draw(pd.concat(cells))
    ratio, *_ = drawn.axes
    lines = {bar.get_label(): bar.lines[0] for bar in ratio.containers if isinstance(bar, ErrorbarContainer)}
    assert np.asarray(lines["gnn_ppo"].get_xydata()).tolist() == [[0.0, pytest.approx(4.0)], [1.0, pytest.approx(1.0)]]
    assert np.asarray(lines["cma_rl"].get_xydata()).tolist() == [[0.0, pytest.approx(2.0)]]
    (legend,) = drawn.legends
    assert [text.get_text() for text in legend.get_texts()] == ["GNN_PPO (n=1)", "CMA_RL (n=1)"]
    assert "standard error" in legend.get_title().get_text()


def test_every_task_has_its_row_of_three_panels() -> None:
    drawn = figure.draw(pd.concat([evaluations(0.3, [0.1], task="push"), evaluations(0.3, [0.1])]))
    assert [axes.get_title(loc="left") for axes in drawn.axes] == ["push", "", "", "catch balls", "", ""]


def test_other_variants_are_left_out_and_missing_columns_named() -> None:
    frame = evaluations(0.3, [0.1])
    for other in ("default", "cutout-0.40_alpha-0.30"):
        with pytest.raises(UserError, match="no finished cell with an alpha"):
            figure.data(frame.assign(variant=other))
    with pytest.raises(UserError, match="lack the column effort"):
        figure.draw(frame.drop(columns="effort"))


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
