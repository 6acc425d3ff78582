"""How much a learning curve still rises at its end: whether a budget was long enough for what is concluded from it."""

from __future__ import annotations

import numpy as np
import pandas as pd

from codesign_bench.stats.curves import CELL_KEYS, curve_statistics

LAST_PART = 1.0 / 3.0
"""Share of the steps over which the rise is measured."""
LEAST_POINTS = 3
"""Evaluations in this part without which there is no estimate: two would make a line of any noise."""


def late_gains(frame: pd.DataFrame, column: str) -> pd.DataFrame:
    """Return how much the mean curve over seeds rises over the last third of its steps.

    It is the rise of the straight line that fits the mean curve best there, which uses every evaluation; a difference
    of two evaluations would mostly be noise.

    Args:
        frame: rows of `codesign_bench.load_results`.
        column: e.g. "return_mean".

    Returns:
        One row per task, method and variant: these, and `late_gain` in units of `column`; NaN for fewer than three
        evaluations in the last third.
    """
    means = curve_statistics(frame, column)
    rows = [
        {**dict(zip(CELL_KEYS, key, strict=True)), "late_gain": _rise(group)}
        for key, group in means.groupby(CELL_KEYS, sort=False)
    ]
    return pd.DataFrame(rows, columns=[*CELL_KEYS, "late_gain"])


def _rise(curve: pd.DataFrame) -> float:
    """Return the rise of the fitted line over the last third of a mean curve."""
    steps, values = curve["env_steps"].to_numpy(dtype=np.float64), curve["mean"].to_numpy(dtype=np.float64)
    length = LAST_PART * steps.max()
    late = steps >= steps.max() - length
    if late.sum() < LEAST_POINTS:
        return float("nan")
    slope, _ = np.polyfit(steps[late], values[late], 1)
    return float(slope * length)
