"""Scores between two reference returns of a task, so that tasks with different rewards can be averaged.

Shapes: `N` returns.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import overload

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Reference:
    """Two mean returns of a task: the scale of its normalised score."""

    zero: float
    """The return that scores 0: a random tool, held still."""
    one: float
    """The return that scores 1: the best that is known of every instance."""


@overload
def normalized_score(returns: float, reference: Reference | None) -> float: ...


@overload
def normalized_score(returns: ArrayLike, reference: Reference | None) -> np.ndarray | float: ...


def normalized_score(returns: ArrayLike, reference: Reference | None) -> np.ndarray | float:
    """Return (return - zero) / (one - zero) of one return or of (N,) returns.

    NaN without a reference, or where its two returns do not differ in this order. Scores below 0 and above 1 are kept:
    a policy may do worse than an idle tool, and better than anything known when the reference was measured.
    """
    values = np.asarray(returns, dtype=np.float64)
    if reference is None or not reference.one > reference.zero:
        scores = np.full_like(values, np.nan)
    else:
        scores = (values - reference.zero) / (reference.one - reference.zero)
    return float(scores) if values.ndim == 0 else scores
