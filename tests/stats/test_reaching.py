"""When curves reach a level, by numbers that can be checked by hand."""

from __future__ import annotations

import math

import pytest

from codesign_bench.stats.reaching import mean_along, monotone, steps_to_reach

pytestmark = pytest.mark.numeric


def test_a_fall_becomes_its_mean() -> None:
    assert monotone([0.0, 3.0, 1.0, 4.0]).tolist() == [0.0, 2.0, 2.0, 4.0]
    assert monotone([3.0, 2.0, 1.0]).tolist() == [2.0, 2.0, 2.0]
    assert monotone([0.0, 1.0, 2.0]).tolist() == [0.0, 1.0, 2.0]


def test_a_level_is_reached_on_the_line_between_two_evaluations() -> None:
    assert steps_to_reach([0.0, 10.0, 20.0], [0.0, 1.0, 3.0], 2.0) == 15.0
    assert steps_to_reach([0.0, 10.0, 20.0], [1.0, 1.0, 3.0], 0.5) == 0.0
    assert steps_to_reach([0.0, 10.0], [0.0, 1.0], 1.0) == 10.0
    assert steps_to_reach([0.0, 10.0], [0.0, 1.0], 1.1) == math.inf


def test_one_lucky_evaluation_reaches_nothing() -> None:
    # The peak of 3 and the fall to 0 after it have mean 1.5; 2 is reached on the last stretch, from 1.5 to 4.
    assert steps_to_reach([0.0, 10.0, 20.0, 30.0], [0.0, 3.0, 0.0, 4.0], 2.0) == pytest.approx(22.0)


def test_the_mean_along_a_curve_weighs_unequal_steps() -> None:
    # From 0 to 1 in 10 steps, then 1 for 30: (5 + 30) / 40.
    assert mean_along([0.0, 10.0, 40.0], [0.0, 1.0, 1.0]) == 0.875
    assert mean_along([0.0], [3.0]) == 3.0
