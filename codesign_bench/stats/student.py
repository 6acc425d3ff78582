"""Means of few seeds and their differences, by Student's t: arrays in, numbers out.

Shapes: `N` and `M` seeds. A percentile bootstrap of three to ten seeds covers less than it promises, since a resample
holds fewer distinct seeds than the sample; the t distribution accounts for the spread being estimated from as few. The
coverage of each interval, as simulated for seeds that are normal, bimodal or at a ceiling, is in docs/statistics.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats as scipy_stats

from codesign_bench.stats.summaries import MIN_SEEDS, finite

CONFIDENCE = 0.95
"""Probability with which an interval is meant to hold the true value."""


@dataclass(frozen=True)
class Estimate:
    """A statistic, its interval, and the p-value of the test against no effect; NaN where data do not give one."""

    value: float
    low: float = math.nan
    high: float = math.nan
    p: float = math.nan
    """Two-sided; before any correction for the number of tests."""


def mean_t_interval(values: ArrayLike, *, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Return the t interval of the mean of (N,) values.

    Both ends are NaN below three values, and where all values are equal: then nothing is known of their spread, and an
    interval of no width would promise what three equal seeds cannot.
    """
    array = finite(values)
    if array.size < MIN_SEEDS or np.ptp(array) == 0.0:
        return math.nan, math.nan
    low, high = scipy_stats.ttest_1samp(array, 0.0).confidence_interval(confidence)
    return float(low), float(high)


def welch(first: ArrayLike, second: ArrayLike, *, confidence: float = CONFIDENCE) -> Estimate:
    """Return mean(first) - mean(second) of independent samples (N,) and (M,) with Welch's interval and p-value.

    Variances may differ. Interval and p are NaN if a sample has fewer than three values or neither varies.
    """
    one, two = finite(first), finite(second)
    value = float(one.mean() - two.mean()) if one.size and two.size else math.nan
    if min(one.size, two.size) < MIN_SEEDS or np.ptp(one) == np.ptp(two) == 0.0:
        return Estimate(value)
    test = scipy_stats.ttest_ind(one, two, equal_var=False)
    low, high = test.confidence_interval(confidence)
    return Estimate(value, float(low), float(high), float(test.pvalue))


def paired_t(differences: ArrayLike, *, confidence: float = CONFIDENCE) -> Estimate:
    """Return the mean of (N,) paired differences with its t interval and the p-value against a mean of 0."""
    array = finite(differences)
    value = float(array.mean()) if array.size else math.nan
    low, high = mean_t_interval(array, confidence=confidence)
    if math.isnan(low):
        return Estimate(value)
    return Estimate(value, low, high, float(scipy_stats.ttest_1samp(array, 0.0).pvalue))


def equivalent(first: ArrayLike, second: ArrayLike, margin: float, *, alpha: float = 1.0 - CONFIDENCE) -> bool:
    """Return whether the means differ by less than `margin`, by two one-sided Welch tests at level `alpha` (TOST).

    Both tests reject exactly if the interval of confidence 1 - 2 alpha is inside of -margin to margin. Where neither
    sample varies, nothing is tested and the answer is no.

    Raises:
        ValueError: the margin is not above 0.
    """
    if not margin > 0.0:
        raise ValueError(f"the margin must be above 0, not {margin:g}")
    estimate = welch(first, second, confidence=1.0 - 2.0 * alpha)
    return -margin < estimate.low and estimate.high < margin
