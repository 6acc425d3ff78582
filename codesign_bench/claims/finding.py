"""The finding of a rule: a verdict with its statistic and interval, or missing data."""

from __future__ import annotations

import math
from dataclasses import dataclass

SUPPORTED, CONTRADICTED, UNDECIDED = "supported", "contradicted", "undecided"
VERDICTS = (SUPPORTED, CONTRADICTED, UNDECIDED)
NOT_ASKED = "not asked"
"""Instead of a verdict: there are no results of a task of the claim."""


class InsufficientData(Exception):
    """The results do not have the data that a rule needs; the message says what is missing."""


@dataclass(frozen=True)
class Finding:
    """A claim's statistic and the verdict."""

    verdict: str
    """One of `VERDICTS`, or `NOT_ASKED`."""
    value: float
    """The statistic over all seeds; NaN if there is none."""
    low: float = math.nan
    """Lower end of its 95 % bootstrap interval over seeds; NaN if there is none."""
    high: float = math.nan
    """Upper end."""
    n: str = ""
    """Sample sizes, e.g. "6 and 6 seeds"."""
    note: str = ""
    """Why the claim is undecided, or a remark on the number."""


def above(low: float, high: float, threshold: float) -> str:
    """Return the verdict on "the statistic is above `threshold`"; undecided if the interval contains it or is NaN."""
    # Comparisons with NaN are false, so a missing interval gives UNDECIDED.
    if low > threshold:
        return SUPPORTED
    return CONTRADICTED if high < threshold else UNDECIDED


def below(low: float, high: float, threshold: float) -> str:
    """Return the verdict on "the statistic is below `threshold`"."""
    return above(-high, -low, -threshold)
