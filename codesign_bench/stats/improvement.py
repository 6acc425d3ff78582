"""Probability of improvement and performance profiles over several tasks with equal weights.

Shapes: `N` and `M` seeds, `R` resamples, `T` thresholds. Both follow Agarwal et al. (2021, "Deep Reinforcement
Learning at the Edge of the Statistical Precipice"); seeds are resampled within each task. A test compares them with
that work's library, rliable.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import ecdf, mannwhitneyu

from codesign_bench.stats.bootstrap import CONFIDENCE, RESAMPLES, bootstrap, interval
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


def probability_of_improvement_interval(
    pairs: Pairs, rng: np.random.Generator, *, confidence: float = CONFIDENCE, resamples: int = RESAMPLES
) -> tuple[float, float]:
    """Return a percentile bootstrap interval of `probability_of_improvement`, seeds resampled within each task.

    If all scores of one method are above all of the other's, it is 1 to 1 (or 0 to 0), since no resample can differ.
    """
    samples = [sample for pair in pairs for sample in pair]

    def average(*resampled: np.ndarray) -> np.ndarray:
        shares = [_share_above(*resampled[i : i + 2]) for i in range(0, len(resampled), 2)]
        return np.asarray(np.mean(shares, axis=0))

    return interval(samples, average, rng, confidence, resamples)


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


def performance_profile_interval(
    scores: Sequence[ArrayLike],
    thresholds: ArrayLike,
    rng: np.random.Generator,
    *,
    confidence: float = CONFIDENCE,
    resamples: int = RESAMPLES,
) -> tuple[np.ndarray, np.ndarray]:
    """Return a pointwise percentile bootstrap interval, (T,) and (T,), of `performance_profile`."""
    levels = np.asarray(thresholds, dtype=np.float64)

    def profile(*resampled: np.ndarray) -> np.ndarray:
        return np.mean([(sample[..., None] > levels).mean(axis=1) for sample in resampled], axis=0)

    samples = [finite(sample) for sample in scores]
    low, high = bootstrap(samples, profile, rng, confidence=confidence, resamples=resamples)
    return np.broadcast_to(low, levels.shape), np.broadcast_to(high, levels.shape)
