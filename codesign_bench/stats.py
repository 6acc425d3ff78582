"""Statistics over seeds: arrays or frames in, numbers or frames out; nothing here reads files or draws.

Shapes: `N` seeds. No spread and no interval is given for fewer than `MIN_SEEDS` seeds but NaN: two runs say too
little about a spread, and a figure that shades one would mislead.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.stats import trim_mean

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


def bootstrap_interval(
    values: ArrayLike, rng: np.random.Generator, *, confidence: float = 0.95, resamples: int = 2000
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
    array = _finite(values)
    if array.size < MIN_SEEDS:
        return float("nan"), float("nan")
    # Drawn by hand, not by scipy.stats.bootstrap: its argument for the generator has another name in each version.
    samples = rng.choice(array, size=(resamples, array.size))
    tail = 0.5 * (1.0 - confidence)
    low, high = np.quantile(trim_mean(samples, 0.25, axis=1), [tail, 1.0 - tail])
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
