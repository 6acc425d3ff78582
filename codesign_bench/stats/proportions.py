"""Shares of outcomes that are 0 or 1, of few trials.

Every resample of three successes is three successes: a bootstrap would give an interval of no width. These intervals
are from the binomial distribution and contain the true share with at least the stated probability.
"""

from __future__ import annotations

from typing import Literal

from scipy.stats import binomtest

from codesign_bench.stats.student import CONFIDENCE, Estimate

Kind = Literal["exact", "wilson"]
"""Clopper and Pearson's, which never covers less than it says, or Wilson's, which is shorter and may by a little."""


def proportion_interval(
    successes: int, trials: int, *, kind: Kind = "exact", confidence: float = CONFIDENCE
) -> tuple[float, float]:
    """Return the interval of the probability of success, given `successes` of `trials`.

    Raises:
        ValueError: there are no trials, or fewer successes than none or more than trials.
    """
    if trials < 1 or not 0 <= successes <= trials:
        raise ValueError(f"{successes} successes of {trials} trials")
    found = binomtest(successes, trials).proportion_ci(confidence_level=confidence, method=kind)
    return float(found.low), float(found.high)


def proportion_test(successes: int, trials: int, null: float = 0.5) -> Estimate:
    """Return the share of successes, its exact interval, and the p-value against a probability of `null`.

    The p-value is twice the probability of the nearer tail, so that it is below 0.05 exactly if the interval leaves
    `null` out.

    Raises:
        ValueError: as `proportion_interval` does.
    """
    low, high = proportion_interval(successes, trials)
    tails = (binomtest(successes, trials, null, alternative=side).pvalue for side in ("less", "greater"))
    return Estimate(successes / trials, low, high, min(1.0, 2.0 * float(min(tails))))
