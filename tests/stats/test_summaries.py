"""Means and standard errors over seeds by hand; nothing is said where there is too little to say."""

from __future__ import annotations

import math

import pytest

from codesign_bench import stats

pytestmark = pytest.mark.numeric


def test_mean_and_standard_error() -> None:
    # Variance ((1-3)^2 + 0 + (5-3)^2) / 2 = 4, so the standard error is sqrt(4 / 3).
    assert stats.mean([1.0, 3.0, 5.0]) == 3.0
    assert stats.standard_error([1.0, 3.0, 5.0]) == pytest.approx(math.sqrt(4.0 / 3.0))


def test_missing_values_are_left_out() -> None:
    assert stats.mean([1.0, math.nan, 3.0]) == 2.0
    assert math.isnan(stats.standard_error([1.0, math.nan, 3.0]))


def test_interquartile_mean_ignores_the_outer_quarters() -> None:
    assert stats.interquartile_mean([-1000.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 1000.0]) == 3.5


def test_nothing_is_said_about_no_values() -> None:
    assert math.isnan(stats.mean([]))
    assert math.isnan(stats.interquartile_mean([]))
