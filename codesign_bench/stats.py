"""Statistics over seeds: arrays or frames in, numbers or frames out; nothing here reads files or draws.

Shapes: `N` seeds, `R` resamples, `T` thresholds. No spread and no interval is given for fewer than `MIN_SEEDS` seeds
but NaN: two runs say too little about a spread, and a figure that shades one would mislead.

Interquartile mean, probability of improvement and performance profile are those of Agarwal et al. (2021, "Deep
Reinforcement Learning at the Edge of the Statistical Precipice"); several tasks weigh alike, and their seeds are
resampled within each task. `tests/test_stats.py` compares them with that work's library, rliable.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.stats import ecdf, mannwhitneyu, trim_mean

from codesign_bench.seeding import generator

RESAMPLES = 2000
CONFIDENCE = 0.95

MIN_SEEDS = 3
"""Fewest seeds for which a spread or an interval is given (ours)."""

CELL_KEYS = ["task", "method", "variant"]
"""Columns that tell apart what is compared; the rows of one such group and one seed are one curve."""


def _finite(values: ArrayLike) -> np.ndarray:
    """Return the values as (N,) floats without the missing ones."""
    array = np.asarray(values, dtype=np.float64).ravel()
    return array[np.isfinite(array)]


def mean(values: ArrayLike) -> float:
    """Return the mean of (N,) values, NaN for none; missing values are left out here and below."""
    array = _finite(values)
    return float(array.mean()) if array.size else float("nan")


def standard_error(values: ArrayLike) -> float:
    """Return the standard error of the mean of (N,) values (the paper's shading), NaN for fewer than three."""
    array = _finite(values)
    return float(array.std(ddof=1) / np.sqrt(array.size)) if array.size >= MIN_SEEDS else float("nan")


def interquartile_mean(values: ArrayLike) -> float:
    """Return the mean of (N,) values without the lowest and the highest quarter (Agarwal et al. 2021), NaN for none."""
    array = _finite(values)
    return float(trim_mean(array, 0.25)) if array.size else float("nan")


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
        samples: arrays (N, ...), one per method, task or both; the seeds of each are resampled by themselves. Rows that
            belong together, e.g. two returns of the same seed, are further axes of one sample and stay together.
        statistic: takes the resampled samples, (R, N, ...) each, and returns (R,) or (R, ...). It may be infinite.
        rng: draws the resamples; the same generator state gives the same interval.
        confidence: probability that the interval is meant to cover.
        resamples: R.

    Returns:
        Lower and upper end, of the shape of one statistic; single NaNs if a sample has fewer than `MIN_SEEDS` seeds.
    """
    arrays = [np.asarray(sample, dtype=np.float64) for sample in samples]
    if min((len(array) for array in arrays), default=0) < MIN_SEEDS:
        return np.array(np.nan), np.array(np.nan)
    # Drawn by hand, not by scipy.stats.bootstrap: its argument for the generator has another name in each version.
    values = statistic(*(rng.choice(array, size=(resamples, len(array)), axis=0) for array in arrays))
    tail = 0.5 * (1.0 - confidence)
    # An end is what some resample gave: between a number and infinity nothing can be interpolated.
    low, high = np.quantile(values, [tail, 1.0 - tail], axis=0, method="inverted_cdf")
    return np.asarray(low), np.asarray(high)


def bootstrap_interval(
    values: ArrayLike, rng: np.random.Generator, *, confidence: float = CONFIDENCE, resamples: int = RESAMPLES
) -> tuple[float, float]:
    """Return a percentile bootstrap interval of the interquartile mean of (N,) values.

    Args:
        values: one value per seed.
        rng: draws the resamples; the same generator state gives the same interval.
        confidence: probability that the interval is meant to cover.
        resamples: bootstrap resamples.

    Returns:
        Lower and upper end; both NaN for fewer than three values, both the value itself where all are equal.
    """
    return _interval([values], _interquartile_means, rng, confidence, resamples)


def _interquartile_means(samples: np.ndarray) -> np.ndarray:
    """Return (R,) interquartile means of (R, N) samples."""
    return np.asarray(trim_mean(samples, 0.25, axis=1))


def mean_interval(
    values: ArrayLike, rng: np.random.Generator, *, confidence: float = CONFIDENCE, resamples: int = RESAMPLES
) -> tuple[float, float]:
    """Return the same interval of the mean of (N,) values."""
    return _interval([values], lambda sample: sample.mean(axis=1), rng, confidence, resamples)


def final_rng(task: str, method: str, variant: str, column: str) -> np.random.Generator:
    """Return what draws the resamples of a method's final values, so that every page gives them the same interval."""
    return generator(0, f"final {column} {task} {method} {variant}")


def mean_difference_interval(
    first: ArrayLike,
    second: ArrayLike,
    rng: np.random.Generator,
    *,
    confidence: float = CONFIDENCE,
    resamples: int = RESAMPLES,
) -> tuple[float, float]:
    """Return the same interval of mean(first) - mean(second), of independent samples (N,) and (M,)."""
    return _interval([first, second], lambda x, y: x.mean(axis=1) - y.mean(axis=1), rng, confidence, resamples)


Pairs = Sequence[tuple[ArrayLike, ArrayLike]]
"""Per task, the scores of two methods, (N,) and (M,)."""


def probability_of_improvement(pairs: Pairs) -> float:
    """Return how probably a seed of the first method is above one of the second, averaged over tasks.

    Equal scores count one half; NaN where a method has no score on some task.
    """
    samples = [(_finite(first), _finite(second)) for first, second in pairs]
    if not samples or not all(first.size and second.size for first, second in samples):
        return float("nan")
    return float(np.mean([_share_above(first, second) for first, second in samples]))


def probability_of_improvement_interval(
    pairs: Pairs, rng: np.random.Generator, *, confidence: float = CONFIDENCE, resamples: int = RESAMPLES
) -> tuple[float, float]:
    """Return a percentile bootstrap interval of `probability_of_improvement`, seeds resampled within each task.

    Where each score of one method is above each of the other's, it is 1 to 1 (or 0 to 0): no resample can differ.
    """
    samples = [sample for pair in pairs for sample in pair]

    def average(*resampled: np.ndarray) -> np.ndarray:
        shares = [_share_above(*resampled[i : i + 2]) for i in range(0, len(resampled), 2)]
        return np.asarray(np.mean(shares, axis=0))

    return _interval(samples, average, rng, confidence, resamples)


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
    samples = [_finite(sample) for sample in scores]
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
    """Return a percentile bootstrap interval, (T,) and (T,), at each threshold of `performance_profile` by itself."""
    levels = np.asarray(thresholds, dtype=np.float64)

    def profile(*resampled: np.ndarray) -> np.ndarray:
        return np.mean([(sample[..., None] > levels).mean(axis=1) for sample in resampled], axis=0)

    samples = [_finite(sample) for sample in scores]
    low, high = bootstrap(samples, profile, rng, confidence=confidence, resamples=resamples)
    return np.broadcast_to(low, levels.shape), np.broadcast_to(high, levels.shape)


def _interval(
    samples: Sequence[ArrayLike],
    statistic: Callable[..., np.ndarray],
    rng: np.random.Generator,
    confidence: float,
    resamples: int,
) -> tuple[float, float]:
    """Return `bootstrap` of the finite values as two numbers, NaN below three seeds."""
    finite = [_finite(sample) for sample in samples]
    low, high = bootstrap(finite, statistic, rng, confidence=confidence, resamples=resamples)
    return float(low), float(high)


def final_values(frame: pd.DataFrame, column: str, *, last: int = 1) -> pd.DataFrame:
    """Return each curve's final value of `column`: the mean over its last `last` evaluations.

    Args:
        frame: rows as `codesign_bench.load_results` gives them.
        column: e.g. "return_mean".
        last: evaluations to average; more of them damp the noise of a single one.

    Returns:
        One row per curve: task, method, variant, seed, env_steps (of the last evaluation), and `column`.
    """
    ordered = frame.dropna(subset=[column]).sort_values("env_steps", kind="stable")
    tails = ordered.groupby([*CELL_KEYS, "seed"]).tail(last)
    return tails.groupby([*CELL_KEYS, "seed"], as_index=False).agg({"env_steps": "max", column: "mean"})


def on_common_grid(frame: pd.DataFrame, column: str) -> pd.DataFrame:
    """Put the curves of all seeds of each task, method and variant on the same environment steps.

    The grid of a group is every step count at which any of its seeds was evaluated. Between two evaluations of a seed
    the value is interpolated; outside of them the seed does not count, so that a curve which ended early is never
    drawn on, and the number of seeds falls along the axis of a partial sweep.

    Args:
        frame: rows as `codesign_bench.load_results` gives them.
        column: e.g. "return_mean".

    Returns:
        Columns task, method, variant, seed, env_steps, and `column`.
    """
    known = frame.dropna(subset=[column])
    columns = [*CELL_KEYS, "seed", "env_steps", column]
    parts = [_group_on_grid(group, column) for _, group in known.groupby(CELL_KEYS, sort=False)]
    return pd.concat(parts, ignore_index=True)[columns] if parts else known[columns]


def _group_on_grid(group: pd.DataFrame, column: str) -> pd.DataFrame:
    """Return one group's curves on the union of their environment steps."""
    grid = np.unique(group["env_steps"].to_numpy(dtype=np.float64))
    parts = []
    for seed, curve in group.groupby("seed"):
        ordered = curve.drop_duplicates("env_steps", keep="last").sort_values("env_steps")
        steps = ordered["env_steps"].to_numpy(dtype=np.float64)
        inside = grid[(grid >= steps[0]) & (grid <= steps[-1])]
        values = np.interp(inside, steps, ordered[column].to_numpy(dtype=np.float64))
        parts.append(pd.DataFrame({"seed": seed, "env_steps": inside, column: values}))
    return pd.concat(parts).assign(**{key: group[key].iloc[0] for key in CELL_KEYS})


def curve_statistics(frame: pd.DataFrame, column: str) -> pd.DataFrame:
    """Return mean, standard error and number of seeds of `column` over seeds, along the environment steps.

    Returns:
        Columns task, method, variant, env_steps, mean, standard_error, seeds.
    """
    grouped = on_common_grid(frame, column).groupby([*CELL_KEYS, "env_steps"])[column]
    return grouped.agg(mean=mean, standard_error=standard_error, seeds="count").reset_index()


def curve_intervals(frame: pd.DataFrame, column: str, rng: np.random.Generator) -> pd.DataFrame:
    """Return interquartile mean, its bootstrap interval and number of seeds of `column`, along the environment steps.

    Whole curves are resampled, so that a resample means the same seeds at every step that the same seeds reached.

    Returns:
        Columns task, method, variant, env_steps, interquartile_mean, low, high (NaN below three seeds), seeds.
    """
    parts = []
    for keys, group in on_common_grid(frame, column).groupby(CELL_KEYS):
        curves = group.pivot(index="env_steps", columns="seed", values=column)
        for reached, stretch in curves.groupby([curves[seed].notna() for seed in curves]):
            values = stretch.to_numpy()[:, np.array(reached)].T
            low, high = bootstrap([values], _interquartile_means, rng)
            table = {
                "env_steps": stretch.index,
                "interquartile_mean": trim_mean(values, 0.25),
                "low": low,
                "high": high,
            }
            parts.append(pd.DataFrame({**dict(zip(CELL_KEYS, keys, strict=True)), **table, "seeds": len(values)}))
    return pd.concat(parts).sort_values([*CELL_KEYS, "env_steps"], kind="stable", ignore_index=True)
