"""Means of few seeds and their differences, by Student's t: arrays in, numbers out.

Shapes: `N` and `M` seeds. A percentile bootstrap of three to ten seeds is too narrow, since a resample has fewer
distinct seeds than the sample; the t distribution accounts for a spread that is estimated from few seeds. The coverage
of each interval, as simulated for seeds that are normal, bimodal or at a ceiling, is in docs/statistics.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats as scipy_stats

from codesign_bench.stats.summaries import MIN_SEEDS, finite

ROUNDING = 1e-9
"""Relative difference up to which values count as equal: means of the same episodes depend on the order of adding."""
CONFIDENCE = 0.95
"""Nominal coverage of an interval."""


@dataclass(frozen=True)
class Estimate:
    """A statistic, its interval, and the p-value of the test against no effect; NaN where data do not give one."""

    value: float
    low: float = math.nan
    high: float = math.nan
    p: float = math.nan
    """Two-sided; before any correction for the number of tests."""


def varies(values: np.ndarray) -> bool:
    """Return whether (N,) values differ by more than rounding."""
    return bool(np.ptp(values) > ROUNDING * np.abs(values).max())


def mean_t_interval(
    values: ArrayLike, *, confidence: float = CONFIDENCE, within: tuple[float, float] = (-math.inf, math.inf)
) -> tuple[float, float]:
    """Return the t interval of the mean of (N,) values, cut off at the ends of `within`, where the mean must lie.

    Both ends are NaN below three values, and if all values are equal: their spread is then unknown, and an interval of
    no width would be wrong.
    """
    array = finite(values)
    if array.size < MIN_SEEDS or not varies(array):
        return math.nan, math.nan
    ends = scipy_stats.ttest_1samp(array, 0.0).confidence_interval(confidence)
    low, high = (min(max(float(end), within[0]), within[1]) for end in (ends.low, ends.high))
    return low, high


def welch(first: ArrayLike, second: ArrayLike, *, confidence: float = CONFIDENCE) -> Estimate:
    """Return mean(first) - mean(second) of independent samples (N,) and (M,) with Welch's interval and p-value.

    Variances may differ. Interval and p are NaN if a sample has fewer than three values or neither varies.
    """
    return welch_across([(first, second)], confidence=confidence)


def one_sample_t(values: ArrayLike, null: float = 0.0, *, confidence: float = CONFIDENCE) -> Estimate:
    """Return the mean of (N,) values with its t interval and the p-value against a mean of `null`."""
    array = finite(values)
    value = float(array.mean()) if array.size else math.nan
    low, high = mean_t_interval(array, confidence=confidence)
    if math.isnan(low):
        return Estimate(value)
    return Estimate(value, low, high, float(scipy_stats.ttest_1samp(array, null).pvalue))


def welch_across(pairs: Sequence[tuple[ArrayLike, ArrayLike]], *, confidence: float = CONFIDENCE) -> Estimate:
    """Return the mean over tasks of mean(first) - mean(second), with Welch's interval and p-value.

    Each sample of each task has a separate variance; the degrees of freedom are Satterthwaite's (1946) of the sum of
    all. Tasks are fixed: the interval is about these tasks, not about others.

    Args:
        pairs: per task, the scores of two methods, (N,) and (M,), on a scale that tasks share.
        confidence: nominal coverage of the interval.

    Returns:
        Interval and p are NaN if a sample has fewer than three values or none of them varies.
    """
    samples = [(finite(first), finite(second)) for first, second in pairs]
    if not samples or not all(one.size and two.size for one, two in samples):
        return Estimate(math.nan)
    value = float(np.mean([one.mean() - two.mean() for one, two in samples]))
    return _satterthwaite(value, [array for pair in samples for array in pair], 1.0 / len(samples), confidence)


def mean_across(samples: Sequence[ArrayLike], *, confidence: float = CONFIDENCE) -> Estimate:
    """Return the mean over tasks of the means of independent samples (N,), one per task, with the same interval."""
    arrays = [finite(sample) for sample in samples]
    if not arrays or not all(array.size for array in arrays):
        return Estimate(math.nan)
    return _satterthwaite(float(np.mean([array.mean() for array in arrays])), arrays, 1.0 / len(arrays), confidence)


def _satterthwaite(value: float, samples: Sequence[np.ndarray], weight: float, confidence: float) -> Estimate:
    """Return the interval and p-value of a sum of sample means, each with plus or minus `weight`; NaN as for pairs."""
    sizes = np.array([array.size for array in samples])
    if sizes.min() < MIN_SEEDS or not any(varies(array) for array in samples):
        return Estimate(value)
    variances = np.array([array.var(ddof=1) for array in samples]) / sizes * weight**2
    freedom = variances.sum() ** 2 / (variances**2 / (sizes - 1)).sum()
    error = math.sqrt(variances.sum())
    half = float(scipy_stats.t.ppf(0.5 + 0.5 * confidence, freedom)) * error
    return Estimate(value, value - half, value + half, float(2.0 * scipy_stats.t.sf(abs(value) / error, freedom)))


def equivalent(first: ArrayLike, second: ArrayLike, margin: float, *, alpha: float = 1.0 - CONFIDENCE) -> bool:
    """Return whether the means differ by less than `margin`, by two one-sided Welch tests at level `alpha` (TOST).

    Both tests reject exactly if the interval of confidence 1 - 2 alpha is inside of -margin to margin. If neither
    sample varies, nothing is tested and the answer is no.

    Raises:
        ValueError: the margin is not above 0.
    """
    if not margin > 0.0:
        raise ValueError(f"the margin must be above 0, not {margin:g}")
    estimate = welch(first, second, confidence=1.0 - 2.0 * alpha)
    return -margin < estimate.low and estimate.high < margin
