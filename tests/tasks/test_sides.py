"""Goals in two mirrored rectangles, by numbers that can be checked by hand."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.tasks._sides import TwoSides

SIDES = TwoSides(distance=(1.0, 3.0), y=(-1.0, 1.0))


@pytest.mark.parametrize(
    ("goal", "inside", "in_a_quarter"),
    [
        ((2.0, 0.0), True, True),
        ((-2.0, 0.0), True, True),
        ((2.4, 0.4), True, True),
        ((2.6, 0.0), True, False),
        ((-2.0, 0.6), True, False),
        ((3.0, -1.0), True, False),
        ((0.9, 0.0), False, False),
        ((-3.1, 0.0), False, False),
        ((2.0, 1.1), False, False),
    ],
)
def test_a_quarter_of_the_area_is_half_as_wide_and_half_as_high(
    goal: tuple[float, float], inside: bool, in_a_quarter: bool
) -> None:
    goals = np.array([goal])
    assert SIDES.contain(goals).tolist() == [inside]
    assert SIDES.in_patches(goals, 0.25).tolist() == [in_a_quarter]


def test_goals_fill_both_sides_alike() -> None:
    x = SIDES.sample_x(np.random.default_rng(0), 4_000)
    assert (np.abs(x) >= 1.0).all()
    assert (np.abs(x) <= 3.0).all()
    # Of 4,000 fair draws the share of one side has a standard deviation of 0.008, the mean distance one of 0.009 m.
    assert (x < 0.0).mean() == pytest.approx(0.5, abs=4 * 0.008)
    assert np.abs(x).mean() == pytest.approx(2.0, abs=4 * 0.0092)
