"""Means and spreads over seeds: arrays in, numbers out.

Shapes: `N` seeds. For fewer than `MIN_SEEDS` seeds, spreads are NaN: two runs say too little about a spread, and
shading it in a figure would be misleading.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import trim_mean

MIN_SEEDS = 3
"""Fewest seeds for a spread or an interval (ours)."""


def finite(values: ArrayLike) -> np.ndarray:
    """Return the finite values as (N,) floats."""
    array = np.asarray(values, dtype=np.float64).ravel()
    return array[np.isfinite(array)]


def mean(values: ArrayLike) -> float:
    """Return the mean of (N,) values, NaN if there are none; missing values are ignored here and below."""
    array = finite(values)
    return float(array.mean()) if array.size else float("nan")


def standard_error(values: ArrayLike) -> float:
    """Return the standard error of the mean of (N,) values (the paper's shading); NaN for fewer than three."""
    array = finite(values)
    return float(array.std(ddof=1) / np.sqrt(array.size)) if array.size >= MIN_SEEDS else float("nan")


def interquartile_mean(values: ArrayLike) -> float:
    """Return the mean of (N,) values without the lowest and highest quarter (Agarwal et al. 2021); NaN if empty."""
    array = finite(values)
    return float(trim_mean(array, 0.25)) if array.size else float("nan")
