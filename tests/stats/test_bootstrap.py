"""Bootstrap intervals hold what they should, follow their generator, and say nothing of too few seeds."""

from __future__ import annotations

import math

import numpy as np
import pytest

from codesign_bench import stats

pytestmark = pytest.mark.numeric


@pytest.mark.parametrize("values", [[], [1.0], [1.0, 2.0]])
def test_no_spread_for_fewer_than_three_seeds(values: list[float]) -> None:
    assert math.isnan(stats.standard_error(values))
    assert all(math.isnan(end) for end in stats.bootstrap_interval(values, np.random.default_rng(0)))


def test_the_same_generator_gives_the_same_interval() -> None:
    values = np.random.default_rng(0).normal(size=20)
    intervals = [stats.bootstrap_interval(values, np.random.default_rng(seed)) for seed in (1, 1, 2)]
    assert intervals[0] == intervals[1] != intervals[2]


def test_the_interval_holds_the_point_estimate_and_narrows_with_less_confidence() -> None:
    values = [0.1, 0.4, 0.5, 0.7, 0.9, 1.0]
    low, high = stats.bootstrap_interval(values, np.random.default_rng(0))
    inner_low, inner_high = stats.bootstrap_interval(values, np.random.default_rng(0), confidence=0.5)
    assert min(values) <= low < inner_low < stats.interquartile_mean(values) < inner_high < high <= max(values)


def test_equal_values_have_an_interval_without_width() -> None:
    assert stats.bootstrap_interval([2.0] * 4, np.random.default_rng(0)) == (2.0, 2.0)


def test_the_interval_covers_the_centre_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(0)
    intervals = [stats.bootstrap_interval(rng.normal(size=30), rng, resamples=300) for _ in range(200)]
    covered = np.mean([low <= 0.0 <= high for low, high in intervals])
    assert 0.88 <= covered <= 0.99


def test_intervals_of_means_and_of_their_difference() -> None:
    rng = np.random.default_rng(0)
    low, high = stats.mean_interval([0.0, 1.0, 5.0], rng)
    # All three seeds drawn alike has probability 1 / 27 > 0.025 for each: the ends are the outermost values.
    assert (low, high) == (0.0, 5.0)
    # Of the 27 equally likely draws, 7 add up to 2 or less and 4 to less, 23 to 10 or less and 20 to less.
    assert stats.mean_interval([0.0, 1.0, 5.0], rng, confidence=0.6) == pytest.approx((2.0 / 3.0, 10.0 / 3.0))
    assert stats.mean_difference_interval([2.0, 2.0, 2.0], [0.5, 0.5, 0.5, 0.5], rng) == (1.5, 1.5)


def test_rows_that_belong_together_stay_together() -> None:
    pairs = np.array([[1.0, 10.0], [2.0, 20.0], [3.0, 30.0]])
    low, high = stats.bootstrap(
        [pairs], lambda x: x[..., 1].mean(axis=1) / x[..., 0].mean(axis=1), np.random.default_rng(0)
    )
    assert (float(low), float(high)) == pytest.approx((10.0, 10.0))


def test_a_statistic_may_be_infinite() -> None:
    def first_or_never(seeds: np.ndarray) -> np.ndarray:
        return np.where(seeds.min(axis=1) > 0.0, seeds.min(axis=1), math.inf)

    assert stats.bootstrap([[0.0, 1.0, 2.0]], first_or_never, np.random.default_rng(0)) == (1.0, math.inf)


def test_no_interval_of_anything_for_fewer_than_three_seeds() -> None:
    rng = np.random.default_rng(0)
    two, three = [0.0, 1.0], [0.0, 1.0, 2.0]
    ends = [
        *stats.mean_interval(two, rng),
        *stats.mean_difference_interval(three, two, rng),
        *stats.probability_of_improvement_interval([(three, three), (two, three)], rng),
        *np.ravel(stats.performance_profile_interval([two, three], [0.5], rng)),
        *stats.bootstrap([two], lambda x: x.mean(axis=1), rng),
        *stats.bootstrap([], lambda: np.zeros(1), rng),
    ]
    assert np.isnan(ends).all()
