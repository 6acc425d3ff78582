"""Probabilities of improvement and performance profiles by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from codesign_bench import stats

pytestmark = pytest.mark.numeric


def test_probability_of_improvement_by_hand() -> None:
    # 1 is above 0, below 2 and equal to 1; 3 is above all three: 1 + 0 + 1/2 + 3 of 6 pairs.
    assert stats.probability_of_improvement([([1.0, 3.0], [0.0, 1.0, 2.0])]) == pytest.approx(0.75)
    assert stats.probability_of_improvement([([1.0], [1.0])]) == 0.5
    # Tasks weigh alike, however many seeds they have.
    assert stats.probability_of_improvement([([1.0] * 9, [0.0] * 9), ([0.0], [1.0])]) == 0.5


def test_probability_of_improvement_of_swapped_methods_adds_up_to_one() -> None:
    first, second = np.random.default_rng(0).normal(size=(2, 6))
    one = stats.probability_of_improvement([(first, second)])
    assert one + stats.probability_of_improvement([(second, first)]) == pytest.approx(1.0)


def test_a_performance_profile_is_the_share_of_seeds_above_each_threshold() -> None:
    profile = stats.performance_profile([[0.0, 1.0, 2.0, 2.0], [1.0]], [-1.0, 0.0, 1.0, 2.0])
    assert profile.tolist() == [1.0, (0.75 + 1.0) / 2.0, (0.5 + 0.0) / 2.0, 0.0]


def test_nothing_is_said_where_a_method_has_no_score() -> None:
    assert math.isnan(stats.probability_of_improvement([([1.0], [])]))
    assert math.isnan(stats.probability_of_improvement([]))
    assert np.isnan(stats.performance_profile([[1.0], []], [0.0, 1.0])).all()
