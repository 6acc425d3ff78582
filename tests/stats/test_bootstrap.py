"""Bootstrap intervals hold what they should, follow their generator, and say nothing of too few seeds."""

from __future__ import annotations

import math

import numpy as np
import pytest

from codesign_bench import stats

pytestmark = pytest.mark.numeric


def means(sample: np.ndarray) -> np.ndarray:
    """Return (R,) means of (R, N)."""
    return np.asarray(sample.mean(axis=1))


def test_the_same_generator_gives_the_same_interval() -> None:
    values = np.random.default_rng(0).normal(size=20)
    intervals = [stats.bootstrap([values], means, np.random.default_rng(seed)) for seed in (1, 1, 2)]
    assert intervals[0] == intervals[1] != intervals[2]


def test_the_interval_of_a_mean_by_counting_resamples() -> None:
    rng = np.random.default_rng(0)
    # All three seeds drawn alike has probability 1 / 27 > 0.025 for each: the ends are the outermost values.
    assert stats.bootstrap([[0.0, 1.0, 5.0]], means, rng) == (0.0, 5.0)
    # Of the 27 equally likely draws, 7 add up to 2 or less and 4 to less, 23 to 10 or less and 20 to less.
    ends = stats.bootstrap([[0.0, 1.0, 5.0]], means, rng, confidence=0.6)
    assert ends == pytest.approx((2.0 / 3.0, 10.0 / 3.0))


def test_several_samples_are_resampled_by_themselves() -> None:
    def difference(first: np.ndarray, second: np.ndarray) -> np.ndarray:
        return means(first) - means(second)

    constant = [[2.0, 2.0, 2.0], [0.5, 0.5, 0.5, 0.5]]
    assert stats.bootstrap(constant, difference, np.random.default_rng(0)) == (1.5, 1.5)


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


def test_no_interval_for_fewer_than_three_seeds() -> None:
    rng = np.random.default_rng(0)
    ends = [*stats.bootstrap([[0.0, 1.0]], means, rng), *stats.bootstrap([], lambda: np.zeros(1), rng)]
    assert np.isnan(ends).all()
