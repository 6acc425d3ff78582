"""The figure of the trade-off: ratio and its parts by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.container import ErrorbarContainer

from codesign_bench.errors import UserError
from codesign_bench.registry import load_module

figure: Any = load_module("paper_figs", "tradeoff")


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
