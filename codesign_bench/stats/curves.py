"""Learning curves of several seeds: final values, and statistics along environment steps; frames in, frames out.

Shapes: `N` seeds.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from codesign_bench.stats.summaries import mean, standard_error

CELL_KEYS = ["task", "method", "variant"]
"""Columns that identify a group of curves; the rows of one group and one seed are one curve."""


def final_values(frame: pd.DataFrame, column: str, *, last: int = 1) -> pd.DataFrame:
    """Return each curve's final value of `column`: the mean over its last `last` evaluations.

    Args:
        frame: rows of `codesign_bench.load_results`.
        column: e.g. "return_mean".
        last: number of evaluations to average; more of them reduce noise.

    Returns:
        One row per curve: task, method, variant, seed, env_steps (of the last evaluation), and `column`.
    """
    ordered = frame.dropna(subset=[column]).sort_values("env_steps", kind="stable")
    tails = ordered.groupby([*CELL_KEYS, "seed"]).tail(last)
    return tails.groupby([*CELL_KEYS, "seed"], as_index=False).agg({"env_steps": "max", column: "mean"})


def on_common_grid(frame: pd.DataFrame, column: str) -> pd.DataFrame:
    """Put the curves of all seeds of each task, method and variant on the same environment steps.

    The grid of a group has every step count at which one of its seeds was evaluated. Values are interpolated between
    two evaluations of a seed. Outside of its evaluations a seed is left out: a curve that ended early is not
    extrapolated, and the number of seeds decreases along a partial sweep.

    Args:
        frame: rows of `codesign_bench.load_results`.
        column: e.g. "return_mean".

    Returns:
        Columns task, method, variant, seed, env_steps, and `column`.
    """
    known = frame.dropna(subset=[column])
    columns = [*CELL_KEYS, "seed", "env_steps", column]
    parts = [_group_on_grid(group, column) for _, group in known.groupby(CELL_KEYS, sort=False)]
    return pd.concat(parts, ignore_index=True)[columns] if parts else known[columns]


def _group_on_grid(group: pd.DataFrame, column: str) -> pd.DataFrame:
    """Return a group's curves on the union of their environment steps."""
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
