"""Many tests at once: p-values adjusted so that a family of tests errs as rarely as a single one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def holm(p_values: Sequence[float]) -> np.ndarray:
    """Return the p-values adjusted by Holm's method (1979), in the given order.

    The smallest of `n` is multiplied by n, the next by n - 1 and so on; an adjusted value is never below one that was
    smaller before. Rejecting what is below 0.05 makes a wrong rejection in the family less probable than 0.05, however
    the tests depend on each other. A test without a p-value (NaN) stays NaN and does not count.
    """
    values = np.asarray(p_values, dtype=np.float64)
    adjusted = np.full_like(values, np.nan)
    known = np.flatnonzero(~np.isnan(values))
    order = known[np.argsort(values[known], kind="stable")]
    factors = len(order) - np.arange(len(order))
    adjusted[order] = np.minimum(np.maximum.accumulate(values[order] * factors), 1.0)
    return adjusted
