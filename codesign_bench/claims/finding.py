"""What a rule finds: a verdict, its statistic and interval, or that data are lacking."""

from __future__ import annotations

import math
from dataclasses import dataclass

SUPPORTED, CONTRADICTED, UNDECIDED = "supported", "contradicted", "undecided"
VERDICTS = (SUPPORTED, CONTRADICTED, UNDECIDED)
NOT_ASKED = "not asked"
"""In place of a verdict: the results hold nothing of a task that the claim speaks of."""


class InsufficientData(Exception):
    """The results do not hold what a rule needs; the message says what is lacking."""


@dataclass(frozen=True)
class Finding:
    """A claim's statistic and what follows from it."""

    verdict: str
    """One of `VERDICTS`, or `NOT_ASKED`."""
    value: float
    """The statistic over all seeds; NaN where there is none."""
    low: float = math.nan
    """Lower end of its 95 % bootstrap interval over seeds; NaN where there is none."""
    high: float = math.nan
    """Upper end."""
    n: str = ""
    """What was counted, e.g. "6 and 6 seeds"."""
    note: str = ""
    """Why it is undecided, or what the number hides."""


def above(low: float, high: float, threshold: float) -> str:
    """Return the verdict on "the statistic lies above `threshold`": undecided where the interval holds or lacks it."""
    if low > threshold:
        return SUPPORTED
    return CONTRADICTED if high < threshold else UNDECIDED


def below(low: float, high: float, threshold: float) -> str:
    """Return the verdict on "the statistic lies below `threshold`"."""
    return above(-high, -low, -threshold)
