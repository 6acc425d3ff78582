"""Means of few seeds and their differences by Student's t, against numbers of a table and worked examples."""

from __future__ import annotations

import math

import numpy as np
import pytest

from codesign_bench.stats.student import equivalent, mean_across, mean_t_interval, one_sample_t, welch, welch_across

pytestmark = pytest.mark.numeric

T_2_95, T_4_95, T_4_90 = 4.302653, 2.776445, 2.131847
"""Quantiles of the t distribution with 2 and 4 degrees of freedom, for two-sided 95 % and 90 %, from a table."""


def test_the_interval_of_a_mean_by_hand() -> None:
    # Mean 2, standard deviation 1, so a standard error of 1 / sqrt 3.
    half = T_2_95 / math.sqrt(3.0)
    assert mean_t_interval([1.0, 2.0, 3.0]) == pytest.approx((2.0 - half, 2.0 + half), rel=1e-6)


def test_an_interval_of_rates_stays_between_zero_and_one() -> None:
    assert mean_t_interval([0.1, 0.5, 0.9], within=(0.0, 1.0)) == (0.0, 1.0)
    assert mean_t_interval([0.4, 0.5, 0.6], within=(0.0, 1.0)) == mean_t_interval([0.4, 0.5, 0.6])


def test_seeds_that_are_too_few_or_all_equal_give_no_interval() -> None:
    for values in ([], [1.0, 2.0], [0.5, 0.5, 0.5], [1.0, 2.0, math.nan]):
        assert all(math.isnan(end) for end in mean_t_interval(values))


def test_a_difference_of_means_by_hand() -> None:
    # Both have variance 1 and three seeds, so Welch's degrees of freedom are 4 and the standard error is sqrt(2 / 3).
    found = welch([1.0, 2.0, 3.0], [4.0, 5.0, 6.0])
    half = T_4_95 * math.sqrt(2.0 / 3.0)
    assert (found.value, found.low, found.high) == pytest.approx((-3.0, -3.0 - half, -3.0 + half), rel=1e-6)
    # t = 3 / sqrt(2 / 3) = 3.674 with 4 degrees of freedom.
    assert found.p == pytest.approx(0.0213, abs=1e-4)


def test_a_method_whose_seeds_are_all_equal_can_be_compared_with_one_whose_are_not() -> None:
    # Only the first varies: two degrees of freedom and its own standard error.
    half = T_2_95 / math.sqrt(3.0)
    found = welch([1.0, 2.0, 3.0], [0.0, 0.0, 0.0])
    assert (found.low, found.high) == pytest.approx((2.0 - half, 2.0 + half), rel=1e-6)


def test_without_any_spread_there_is_a_difference_but_no_interval() -> None:
    found = welch([1.0] * 3, [0.0] * 3)
    assert found.value == 1.0
    assert math.isnan(found.low)
    assert math.isnan(found.p)
    assert math.isnan(welch([1.0, 2.0], [0.0, 1.0, 2.0]).low)


def test_a_mean_against_a_number_by_hand() -> None:
    found = one_sample_t([1.0, 2.0, 3.0])
    assert (found.value, found.low) == pytest.approx((2.0, 2.0 - T_2_95 / math.sqrt(3.0)), rel=1e-6)
    # t = 2 sqrt 3 = 3.464 with 2 degrees of freedom.
    assert found.p == pytest.approx(0.0742, abs=1e-4)
    shifted = one_sample_t([11.0, 12.0, 13.0], 10.0)
    assert (shifted.value, shifted.low - 10.0, shifted.p) == pytest.approx((12.0, found.low, found.p))
    assert one_sample_t([1.0, 1.0, 1.0]).value == 1.0
    assert math.isnan(one_sample_t([1.0, 1.0, 1.0]).p)


def test_one_task_is_compared_as_by_welch() -> None:
    first, second = [1.0, 2.0, 4.0], [0.0, 0.5, 0.7, 3.0]
    one, across = welch(first, second), welch_across([(first, second)])
    assert (across.value, across.low, across.high, across.p) == pytest.approx((one.value, one.low, one.high, one.p))


def test_two_tasks_halve_the_variance_and_add_their_degrees_of_freedom() -> None:
    # Four samples of variance 1 and three seeds: variance 4 / 3 / 2^2, degrees of freedom 4 * 2 = 8.
    found = welch_across([([1.0, 2.0, 3.0], [0.0, 1.0, 2.0]), ([4.0, 5.0, 6.0], [1.0, 2.0, 3.0])])
    half = 2.306004 * math.sqrt(1.0 / 3.0)
    assert (found.value, found.low, found.high) == pytest.approx((2.0, 2.0 - half, 2.0 + half), rel=1e-6)
    # t = 2 sqrt 3 = 3.464 with 8 degrees of freedom.
    assert found.p == pytest.approx(0.0085, abs=1e-4)


def test_a_mean_across_tasks_is_a_difference_from_zero() -> None:
    found = mean_across([[1.0, 2.0, 3.0], [4.0, 6.0, 8.0, 10.0]])
    zeros = [0.0] * 9999
    same = welch_across([([1.0, 2.0, 3.0], zeros), ([4.0, 6.0, 8.0, 10.0], zeros)])
    assert (found.value, found.low, found.high) == pytest.approx((4.5, same.low, same.high))
    assert math.isnan(mean_across([]).value)
    assert math.isnan(mean_across([[1.0, 2.0]]).low)


def test_tasks_without_seeds_or_spread_give_no_interval() -> None:
    assert math.isnan(welch_across([]).value)
    assert math.isnan(welch_across([([1.0], [])]).value)
    assert math.isnan(welch_across([([1.0] * 3, [0.0] * 3)]).low)
    assert math.isnan(welch_across([([1.0, 2.0, 3.0], [0.0, 1.0])]).low)


def test_means_are_equivalent_if_the_ninety_percent_interval_is_within_the_margin() -> None:
    first, second = [1.0, 2.0, 3.0], [1.0, 2.0, 3.0]
    half = T_4_90 * math.sqrt(2.0 / 3.0)
    assert equivalent(first, second, 1.01 * half)
    assert not equivalent(first, second, 0.99 * half)
    assert not equivalent([1.0] * 3, [1.0] * 3, 1.0), "nothing is known of the spread"
    with pytest.raises(ValueError, match="margin must be above 0"):
        equivalent(first, second, 0.0)


@pytest.mark.parametrize("seeds", [3, 6, 10])
def test_intervals_of_normal_seeds_cover_what_they_say(seeds: int) -> None:
    rng, trials = np.random.default_rng(seeds), 2_000
    means, differences = 0, 0
    for _ in range(trials):
        one, two = rng.normal(size=seeds), rng.normal(scale=3.0, size=seeds)
        low, high = mean_t_interval(one)
        means += low < 0.0 < high
        found = welch(one, two)
        differences += found.low < 0.0 < found.high
    # 95 % of 2,000 with a standard deviation of 10: more than 1,860 at least but once in a thousand times.
    assert means > 1_860
    assert differences > 1_860
