"""The figure of design values: its numbers by hand, and its picture with everything that it names."""

from __future__ import annotations

from math import isnan
from typing import Any

import pandas as pd
import pytest

from codesign_bench.errors import UserError
from codesign_bench.registry import load_module

figure: Any = load_module("paper_figs", "design_values")


def judged(
    values: list[float], returns: list[float], *, own: float = 2.5, seed: int = 0, instance: int = 0
) -> pd.DataFrame:
    """Return rows of one instance: random tools with these values and returns, and the designer's (return `own`)."""
    tools = [("designer", 9.0, own), *(("random", *pair) for pair in zip(values, returns, strict=True))]
    rows = [
        {"task": "push", "method": "critic_design", "variant": "default", "seed": seed, "label": "climbed"}
        | {"instance": instance, "tool": tool, "origin": origin, "value": value, "return": earned}
        for tool, (origin, value, earned) in enumerate(tools)
    ]
    return pd.DataFrame(rows)


ORDERED = judged([0.0, 1.0, 2.0, 3.0], [1.0, 2.0, 3.0, 4.0])
"""Values order the returns perfectly; two of four random tools earn less than the designer's."""
REVERSED = judged([3.0, 2.0, 1.0, 0.0], [1.0, 2.0, 3.0, 4.0], own=4.0, instance=1)
"""They order them the wrong way round; three earn less than the designer's, and one the same."""


def test_the_numbers_by_hand() -> None:
    (row,) = figure.data(pd.concat([ORDERED, REVERSED])).to_dict("records")
    assert (row["seeds"], row["instances"], row["tools"]) == (1, 2, 4)
    assert row["rank_correlation"] == pytest.approx((1.0 - 1.0) / 2)
    assert row["designer_ahead"] == pytest.approx((0.5 + 0.875) / 2)
    assert isnan(row["rank_correlation_low"]), "one seed has no interval"


def test_goals_that_are_easy_for_every_tool_do_not_count_as_knowledge_of_tools() -> None:
    easy = judged([10.0, 11.0, 12.0, 13.0], [14.0, 13.0, 12.0, 11.0], instance=1)
    hard = judged([0.0, 1.0, 2.0, 3.0], [4.0, 3.0, 2.0, 1.0])
    (row,) = figure.data(pd.concat([easy, hard])).to_dict("records")
    assert row["rank_correlation"] == pytest.approx(-1.0), "all dots together are ordered well"


def test_instances_on_which_all_tools_earn_the_same_have_no_correlation() -> None:
    alike = judged([0.0, 1.0, 2.0, 3.0], [1.0] * 4, instance=1)
    (row,) = figure.data(pd.concat([ORDERED, alike])).to_dict("records")
    assert (row["instances"], row["rank_correlation"]) == (1, pytest.approx(1.0))


def test_three_seeds_have_an_interval_within_bounds() -> None:
    frames = [
        judged([0.0, 1.0, 2.0], returns, seed=seed) for seed, returns in enumerate(([1, 2, 3], [1, 2, 3], [2, 1, 3]))
    ]
    (row,) = figure.data(pd.concat(frames)).to_dict("records")
    assert row["rank_correlation"] == pytest.approx((1 + 1 + 0.5) / 3)
    assert row["rank_correlation_low"] < row["rank_correlation"] < row["rank_correlation_high"] <= 1.0


def test_the_picture_shows_every_tool_and_the_numbers() -> None:
    drawn = figure.draw(pd.concat([ORDERED, REVERSED]))
    (axes,) = drawn.axes
    dots = {line.get_gid(): line.get_xydata().tolist() for line in axes.lines}
    assert dots["designer"] == [[9.0, 2.5], [9.0, 4.0]]
    assert dots["random"][:4] == [[0.0, 1.0], [1.0, 2.0], [2.0, 3.0], [3.0, 4.0]]
    assert "push, climbed (1)" in axes.get_title(loc="left")
    assert "rank correlation 0.00" in axes.get_title(loc="left")
    (legend,) = drawn.legends
    place = legend.get_window_extent()
    assert drawn.bbox.x0 <= place.x0 < place.x1 <= drawn.bbox.x1


def test_other_variants_alone_are_refused() -> None:
    with pytest.raises(UserError, match="no design values of variant 'default'"):
        figure.data(ORDERED.assign(variant="alpha-0.30"))
