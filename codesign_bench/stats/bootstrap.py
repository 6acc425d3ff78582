"""Percentile bootstrap intervals over seeds: arrays in, numbers out.

Shapes: `N` seeds, `R` resamples. For fewer than `MIN_SEEDS` seeds, intervals are NaN.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import trim_mean

from codesign_bench.seeding import generator
from codesign_bench.stats.summaries import MIN_SEEDS, finite

RESAMPLES = 2000
CONFIDENCE = 0.95


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


def bootstrap_interval(
    values: ArrayLike, rng: np.random.Generator, *, confidence: float = CONFIDENCE, resamples: int = RESAMPLES
) -> tuple[float, float]:
    """Return a percentile bootstrap interval of the interquartile mean of (N,) values.

    Args:
        values: one value per seed.
        rng: draws the resamples; the same generator state gives the same interval.
        confidence: nominal coverage of the interval.
        resamples: number of bootstrap resamples.

    Returns:
        Lower and upper end; both NaN for fewer than three values, both equal to the value if all values are equal.
    """
    return interval([values], interquartile_means, rng, confidence, resamples)


def interquartile_means(samples: np.ndarray) -> np.ndarray:
    """Return the interquartile means (R,) of samples (R, N)."""
    return np.asarray(trim_mean(samples, 0.25, axis=1))


def mean_interval(
    values: ArrayLike, rng: np.random.Generator, *, confidence: float = CONFIDENCE, resamples: int = RESAMPLES
) -> tuple[float, float]:
    """Return the same kind of interval for the mean of (N,) values."""
    return interval([values], lambda sample: sample.mean(axis=1), rng, confidence, resamples)


def final_rng(task: str, method: str, variant: str, column: str) -> np.random.Generator:
    """Return the generator for resamples of a method's final values, so that every page has the same interval."""
    return generator(0, f"final {column} {task} {method} {variant}")


def mean_difference_interval(
    first: ArrayLike,
    second: ArrayLike,
    rng: np.random.Generator,
    *,
    confidence: float = CONFIDENCE,
    resamples: int = RESAMPLES,
) -> tuple[float, float]:
    """Return the same kind of interval for mean(first) - mean(second) of independent samples (N,) and (M,)."""
    return interval([first, second], lambda x, y: x.mean(axis=1) - y.mean(axis=1), rng, confidence, resamples)


def interval(
    samples: Sequence[ArrayLike],
    statistic: Callable[..., np.ndarray],
    rng: np.random.Generator,
    confidence: float,
    resamples: int,
) -> tuple[float, float]:
    """Return `bootstrap` of the finite values as two numbers; NaN below three seeds."""
    low, high = bootstrap(
        [finite(sample) for sample in samples], statistic, rng, confidence=confidence, resamples=resamples
    )
    return float(low), float(high)
