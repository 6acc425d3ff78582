"""Shares of outcomes that are 0 or 1, of few trials.

A resample of three successes holds three successes: a bootstrap would give an interval of no width. These intervals
come from the binomial distribution and hold the true share with at least the stated probability.
"""

from __future__ import annotations

from typing import Literal

from scipy.stats import binomtest

from codesign_bench.stats.student import CONFIDENCE

Kind = Literal["exact", "wilson"]
"""Clopper and Pearson's, which never covers less than it says, or Wilson's, which is shorter and may by a little."""


def proportion_interval(
    successes: int, trials: int, *, kind: Kind = "exact", confidence: float = CONFIDENCE
) -> tuple[float, float]:
    """Return the interval of the probability of success, given `successes` of `trials`.

    Raises:
        ValueError: there are no trials, or more successes than trials.
    """
    found = binomtest(successes, trials).proportion_ci(confidence_level=confidence, method=kind)
    return float(found.low), float(found.high)
