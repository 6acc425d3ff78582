"""The figure of design sensitivity: its numbers by hand, its picture with everything that it names."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pandas as pd
import pytest

from codesign_bench.errors import UserError
from codesign_bench.registry import load_module

figure: Any = load_module("paper_figs", "design_sensitivity")

SOLVED = np.array([[1, 1, 0, 0], [0, 0, 0, 0], [1, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 0]])
"""Three random tools, then one scripted tool for each of four goals; the fourth goal is solved by none."""


def table(task: str = "push") -> pd.DataFrame:
    """Return a table of seven tools on four goals."""
    rows = []
    for tool, goal in product(range(7), range(4)):
        success = int(SOLVED[tool, goal])
        kind, own = ("random", 0) if tool < 3 else ("scripted", int(tool - 3 == goal))
        rows.append((task, tool, kind, goal, own, 2.0 - success, 0.5, success, "distance", "m"))
    columns = ["task", "tool", "kind", "goal", "own", "outcome", "return", "success", "outcome_name", "outcome_unit"]
    return pd.DataFrame(rows, columns=columns)


def test_the_numbers_by_hand() -> None:
    (row,) = figure.data(table()).to_dict("records")
    assert (row["task"], row["tools"], row["goals"]) == ("push", 7, 4)
    assert row["random_mean"] == pytest.approx((0.5 + 0.0 + 0.25) / 3)
    assert row["best_single"] == 0.5
    assert row["own"] == 0.75  # The fourth goal's own tool fails.
    assert row["any"] == 0.75
    assert row["random_sd"] == pytest.approx(np.std([0.5, 0.0, 0.25], ddof=1))
    assert (row["outcome_name"], row["outcome_unit"]) == ("distance", "m")


def test_every_task_has_its_two_panels_in_the_papers_order() -> None:
    frame = pd.concat([table("fetch_cube"), table("another"), table("push"), table("scoop")])
    drawn = figure.draw(frame)
    titles = [axes.get_title() for axes in drawn.axes if axes.get_title()]
    assert titles == ["push", "scoop", "fetch cube", "another"]
    labels = [axes.get_xlabel() for axes in drawn.axes if axes.get_visible()]
    assert labels.count("7 tools") == labels.count("share of goals solved") == 4
    (legend,) = drawn.legends
    assert [text.get_text() for text in legend.get_texts()] == [text for _, _, text in figure.MARKS.values()]


def test_a_single_task_fits_a_column() -> None:
    assert figure.draw(table()).get_figwidth() < figure.draw(pd.concat([table(), table("scoop")])).get_figwidth()


def test_a_table_without_rows_or_columns_is_refused() -> None:
    with pytest.raises(UserError, match="have no rows"):
        figure.data(table().iloc[:0])
    with pytest.raises(UserError, match="lack the column own"):
        figure.data(table().drop(columns="own"))
