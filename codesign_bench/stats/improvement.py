"""How probably one method is above another, and performance profiles, over several tasks that weigh alike.

Shapes: `N` and `M` seeds, `T` thresholds. Both are those of Agarwal et al. (2021, "Deep Reinforcement Learning at the
Edge of the Statistical Precipice"). A test compares them with that work's library, rliable. Neither has an interval
here: where one method is always above the other, every resample says so, and the interval has no width.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import ecdf, mannwhitneyu

from codesign_bench.stats.summaries import finite

Pairs = Sequence[tuple[ArrayLike, ArrayLike]]
"""Per task, the scores of two methods, (N,) and (M,)."""


def probability_of_improvement(pairs: Pairs) -> float:
    """Return how probably a seed of the first method is above one of the second, averaged over tasks.

    Equal scores count one half; NaN where a method has no score on some task.
    """
    samples = [(finite(first), finite(second)) for first, second in pairs]
    if not samples or not all(first.size and second.size for first, second in samples):
        return float("nan")
    return float(np.mean([_share_above(first, second) for first, second in samples]))


def _share_above(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return, along the last axis, the share of pairs in which the first is above, ties counting one half."""
    statistic = mannwhitneyu(first, second, axis=-1, method="asymptotic").statistic
    return np.asarray(statistic / (first.shape[-1] * second.shape[-1]))


def performance_profile(scores: Sequence[ArrayLike], thresholds: ArrayLike) -> np.ndarray:
    """Return (T,): the share of seeds above each threshold, averaged over tasks.

    Args:
        scores: (N,) per task, on a scale that tasks share.
        thresholds: (T,)
    """
    levels = np.asarray(thresholds, dtype=np.float64)
    samples = [finite(sample) for sample in scores]
    if not samples or not all(sample.size for sample in samples):
        return np.full_like(levels, np.nan)
    return np.asarray(np.mean([ecdf(sample).sf.evaluate(levels) for sample in samples], axis=0))
