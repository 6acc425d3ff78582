"""Probability of improvement and performance profiles over several tasks with equal weights.

Shapes: `N` and `M` seeds, `T` thresholds. Both follow Agarwal et al. (2021, "Deep Reinforcement Learning at the Edge of
the Statistical Precipice"). A test compares them with that work's library, rliable. Neither has an interval here: if
all scores of one method are above all of the other's, no resample can differ, and the interval has no width.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import ecdf, mannwhitneyu

from codesign_bench.stats.summaries import finite

Pairs = Sequence[tuple[ArrayLike, ArrayLike]]
"""For each task, the scores of two methods, (N,) and (M,)."""


def probability_of_improvement(pairs: Pairs) -> float:
    """Return the probability that a seed of the first method scores higher than one of the second, averaged over tasks.

    Equal scores count one half; NaN if a method has no score on a task.
    """
    samples = [(finite(first), finite(second)) for first, second in pairs]
    if not samples or not all(first.size and second.size for first, second in samples):
        return float("nan")
    return float(np.mean([_share_above(first, second) for first, second in samples]))


def _share_above(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return, along the last axis, the fraction of pairs in which the first is higher; ties count one half."""
    # Mann-Whitney's U is the number of pairs that the first wins, with ties as halves. Only the statistic is used; the
    # asymptotic method avoids the cost of an exact p-value.
    statistic = mannwhitneyu(first, second, axis=-1, method="asymptotic").statistic
    return np.asarray(statistic / (first.shape[-1] * second.shape[-1]))


def performance_profile(scores: Sequence[ArrayLike], thresholds: ArrayLike) -> np.ndarray:
    """Return (T,): the fraction of seeds above each threshold, averaged over tasks.

    Args:
        scores: (N,) per task, on a common scale.
        thresholds: (T,)
    """
    levels = np.asarray(thresholds, dtype=np.float64)
    samples = [finite(sample) for sample in scores]
    if not samples or not all(sample.size for sample in samples):
        return np.full_like(levels, np.nan)
    return np.asarray(np.mean([ecdf(sample).sf.evaluate(levels) for sample in samples], axis=0))
