"""When a noisy learning curve reaches a level: arrays in, numbers out.

Shapes: `T` evaluations along a curve. The first evaluation above a level may be luck, and the more a curve scatters the
sooner luck comes. A curve is therefore first replaced by the rising curve nearest to it (isotonic regression).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import trapezoid
from scipy.optimize import isotonic_regression


def monotone(values: ArrayLike) -> np.ndarray:
    """Return the rising (T,) values with the least squared distance from (T,) values; a fall becomes its mean."""
    return np.asarray(isotonic_regression(np.asarray(values, dtype=np.float64)).x)


def steps_to_reach(steps: ArrayLike, values: ArrayLike, target: float) -> float:
    """Return the environment steps (T,) at which values (T,), made monotone, reach a target; infinity if never.

    Curves are interpolated linearly between evaluations.
    """
    at, rising = np.asarray(steps, dtype=np.float64), monotone(values)
    if not rising[-1] >= target:
        return math.inf
    first = int(np.argmax(rising >= target))
    if first == 0:
        return float(at[0])
    share = (target - rising[first - 1]) / (rising[first] - rising[first - 1])
    return float(at[first - 1] + share * (at[first] - at[first - 1]))


def mean_along(steps: ArrayLike, values: ArrayLike) -> float:
    """Return the mean of a curve over its steps: the area under it, divided by its length; T may be 1."""
    at, along = np.asarray(steps, dtype=np.float64), np.asarray(values, dtype=np.float64)
    return float(trapezoid(along, at) / (at[-1] - at[0]) if len(at) > 1 else along[0])
