"""Percentile bootstrap intervals: arrays in, numbers out.

They serve statistics over several tasks, where a resample has many curves. Means of few seeds have the intervals of
`student.py`, since a resample of three to ten seeds is less diverse than the sample, and the interval too narrow.

Shapes: `N` seeds, `R` resamples. For fewer than `MIN_SEEDS` seeds, intervals are NaN.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from codesign_bench.stats.student import CONFIDENCE
from codesign_bench.stats.summaries import MIN_SEEDS

RESAMPLES = 2000


def bootstrap(
    samples: Sequence[ArrayLike],
    statistic: Callable[..., np.ndarray],
    rng: np.random.Generator,
    *,
    confidence: float = CONFIDENCE,
    resamples: int = RESAMPLES,
) -> tuple[np.ndarray, np.ndarray]:
    """Return a percentile bootstrap interval of a statistic of one or several independent samples.

    Args:
        samples: arrays (N, ...), one per method, task or both; seeds are resampled separately in each. Paired values,
            e.g. two returns of the same seed, are further axes of one sample and stay together.
        statistic: takes the resampled samples, (R, N, ...) each, and returns (R,) or (R, ...). It may be infinite.
        rng: draws the resamples; the same generator state gives the same interval.
        confidence: nominal coverage of the interval.
        resamples: R.

    Returns:
        Lower and upper end, with the shape of one statistic; scalar NaNs if a sample has fewer than `MIN_SEEDS` seeds.
    """
    arrays = [np.asarray(sample, dtype=np.float64) for sample in samples]
    if min((len(array) for array in arrays), default=0) < MIN_SEEDS:
        return np.array(np.nan), np.array(np.nan)
    # Each sample is resampled separately, with its own number of seeds: runs of different methods are independent. Not
    # by scipy.stats.bootstrap, whose argument for the generator has different names in different versions.
    values = statistic(*(rng.choice(array, size=(resamples, len(array)), axis=0) for array in arrays))
    tail = 0.5 * (1.0 - confidence)
    # The inverted CDF returns the value of one resample. Interpolation would give NaN between a number and infinity,
    # e.g. for steps to a return that some resamples never reach.
    low, high = np.quantile(values, [tail, 1.0 - tail], axis=0, method="inverted_cdf")
    return np.asarray(low), np.asarray(high)
