"""What a claim is, the rule that judges it, and what the rule finds."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from codesign_bench.claims.evidence import Evidence

SUPPORTED, CONTRADICTED, UNDECIDED = "supported", "contradicted", "undecided"
VERDICTS = (SUPPORTED, CONTRADICTED, UNDECIDED)


class Lacking(Exception):
    """The results do not hold what a rule needs; the message says what is lacking."""


@dataclass(frozen=True)
class Finding:
    """A claim's statistic and what follows from it."""

    verdict: str
    """One of `VERDICTS`."""
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


@dataclass(frozen=True)
class Rule:
    """How a claim is judged, written down before any result is looked at."""

    kind: str
    """Name of the rule, under which docs/claims.md explains it."""
    statistic: str
    """The number that is computed, in a few words."""
    words: str
    """When it supports and when it contradicts the claim."""
    needs: tuple[str, ...]
    """Commands that make the data; `{results}` stands for the results folder, `{profile}` for its option or nothing."""
    judge: Callable[[Evidence, np.random.Generator], Finding]
    """The rule itself; raises `Lacking` where data are missing."""


@dataclass(frozen=True)
class Claim:
    """One finding of the paper, with the rule that judges it."""

    name: str
    """Unique, for tables and files."""
    sentence: str
    """What the paper claims, in our words."""
    source: str
    """The paper's section, figure or table."""
    rule: Rule


def above(low: float, high: float, threshold: float) -> str:
    """Return the verdict on "the statistic lies above `threshold`": undecided where the interval holds or lacks it."""
    if low > threshold:
        return SUPPORTED
    return CONTRADICTED if high < threshold else UNDECIDED


def below(low: float, high: float, threshold: float) -> str:
    """Return the verdict on "the statistic lies below `threshold`"."""
    return above(-high, -low, -threshold)
