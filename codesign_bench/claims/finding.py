"""What a rule finds: a verdict, its statistic with interval and p-value, or that data are lacking."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from codesign_bench.stats import Estimate

SUPPORTED, CONTRADICTED, UNDECIDED, CEILING = "supported", "contradicted", "undecided", "ceiling"
VERDICTS = (SUPPORTED, CONTRADICTED, UNDECIDED, CEILING)
NOT_ASKED = "not asked"
"""In place of a verdict: the results hold nothing of a task that the claim speaks of."""
LEVEL = 0.05
"""A verdict that follows from a test needs an adjusted p-value below this."""


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
    """Lower end of its 95 % interval; NaN where there is none."""
    high: float = math.nan
    """Upper end."""
    n: str = ""
    """What was counted, e.g. "6 and 6 seeds"."""
    note: str = ""
    """Why it is undecided, or what the number hides."""
    p: float = math.nan
    """Two-sided, of this claim alone; NaN for rules that test nothing."""
    p_adjusted: float = math.nan
    """Adjusted by Holm's method for all claims of the same kind of rule; filled in when they are judged together."""
    family_size: int = 0
    """How many claims that adjusted for."""

    @property
    def is_directional(self) -> bool:
        """Whether it says which way the claim goes."""
        return self.verdict in (SUPPORTED, CONTRADICTED)

    def adjusted(self, p_adjusted: float, family_size: int) -> Finding:
        """Return the finding as one of a family: undecided if the adjusted p-value is not below `LEVEL`."""
        known = replace(self, p_adjusted=p_adjusted, family_size=family_size)
        if not self.is_directional or p_adjusted < LEVEL:
            return known
        why = f"p is {probability(p_adjusted)} after adjustment for {family_size} claims"
        return replace(known, verdict=UNDECIDED, note=joined(self.note, why))


def above(found: Estimate, threshold: float = 0.0, *, least: float = 0.0) -> str:
    """Return the verdict on "the statistic lies above `threshold`".

    It is undecided where the interval holds the threshold or is missing, and where the statistic is nearer to the
    threshold than `least`, the smallest effect that counts.
    """
    if found.low > threshold and found.value - threshold >= least:
        return SUPPORTED
    return CONTRADICTED if found.high < threshold and threshold - found.value >= least else UNDECIDED


def below(found: Estimate, threshold: float = 0.0, *, least: float = 0.0) -> str:
    """Return the verdict on "the statistic lies below `threshold`"."""
    opposite = {SUPPORTED: CONTRADICTED, CONTRADICTED: SUPPORTED, UNDECIDED: UNDECIDED}
    return opposite[above(found, threshold, least=least)]


def reason(found: Estimate, threshold: float = 0.0, *, least: float = 0.0) -> str:
    """Return why `above` and `below` are undecided; empty where they are not, or where the interval shows it."""
    if math.isnan(found.low):
        return "seeds do not differ, so nothing is known of their spread"
    outside = found.low > threshold or found.high < threshold
    return f"smaller than the least effect of {least:.2g}" if outside and abs(found.value - threshold) < least else ""


def joined(*notes: str) -> str:
    """Return the notes that are not empty as one."""
    return "; ".join(filter(None, notes))


def probability(p: float) -> str:
    """Return a p-value as text; empty for NaN."""
    if math.isnan(p):
        return ""
    return f"{p:.3f}" if p >= 0.001 else "<0.001"
