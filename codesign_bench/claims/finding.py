"""The finding of a rule: a verdict with its statistic, interval and p-value, or missing data."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from codesign_bench.stats import Estimate

SUPPORTED, CONTRADICTED, UNDECIDED, CEILING = "supported", "contradicted", "undecided", "ceiling"
VERDICTS = (SUPPORTED, CONTRADICTED, UNDECIDED, CEILING)
NOT_ASKED = "not asked"
"""Instead of a verdict: there are no results of a task of the claim."""
LEVEL = 0.05
"""A verdict that follows from a test needs an adjusted p-value below this."""


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
    """Lower end of its 95 % interval; NaN if there is none."""
    high: float = math.nan
    """Upper end."""
    n: str = ""
    """Sample sizes, e.g. "6 and 6 seeds"."""
    note: str = ""
    """Why the claim is undecided, or a remark on the number."""
    p: float = math.nan
    """Two-sided p-value of this claim only; NaN for rules without a test."""
    p_adjusted: float = math.nan
    """Adjusted for the claim's looks, then by Holm's method for all claims of the same kind of rule; set when the
    claims are judged together."""
    family_size: int = 0
    """Number of claims in that adjustment."""
    equivalent: bool = False
    """Whether an undecided difference is shown to be smaller than the least that counts; more seeds are not needed."""

    @property
    def is_directional(self) -> bool:
        """Whether the claim is supported or contradicted."""
        return self.verdict in (SUPPORTED, CONTRADICTED)

    def adjusted(self, p_adjusted: float, family_size: int, looks: int = 1) -> Finding:
        """Return the finding as one of a family: undecided if the adjusted p-value is not below `LEVEL`."""
        known = replace(self, p_adjusted=p_adjusted, family_size=family_size)
        if not self.is_directional or p_adjusted < LEVEL:
            return known
        each = f", each judged up to {looks} times" if looks > 1 else ""
        why = f"p is {probability(p_adjusted)} after adjustment for {family_size} claims{each}"
        return replace(known, verdict=UNDECIDED, note=joined(self.note, why))


def above(found: Estimate, threshold: float = 0.0, *, least: float = 0.0) -> str:
    """Return the verdict on "the statistic is above `threshold`".

    It is undecided if the interval contains the threshold or is missing, or if the statistic differs from the threshold
    by less than `least`, the smallest effect that counts.
    """
    # Comparisons with NaN are false, so a missing interval gives UNDECIDED.
    if found.low > threshold and found.value - threshold >= least:
        return SUPPORTED
    return CONTRADICTED if found.high < threshold and threshold - found.value >= least else UNDECIDED


def below(found: Estimate, threshold: float = 0.0, *, least: float = 0.0) -> str:
    """Return the verdict on "the statistic is below `threshold`"."""
    opposite = {SUPPORTED: CONTRADICTED, CONTRADICTED: SUPPORTED, UNDECIDED: UNDECIDED}
    return opposite[above(found, threshold, least=least)]


def reason(found: Estimate, threshold: float = 0.0, *, least: float = 0.0) -> str:
    """Return why `above` and `below` are undecided; empty if they are not, or if the interval shows it."""
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
