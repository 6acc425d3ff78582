"""What a claim is, and the rule that judges it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import Finding
from codesign_bench.console import Log


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
    """The rule itself; raises `InsufficientData` where data are missing."""
    measure: Callable[[Path, Log], object] | None = None
    """Makes what no cell holds by playing finished policies or scripts, if it is missing; it may take minutes."""


@dataclass(frozen=True)
class Claim:
    """One finding of a study, with the rule that judges it."""

    name: str
    """Unique, for tables and files."""
    sentence: str
    """What is claimed, in our words."""
    source: str
    """Section, figure or table of a publication, or "ours"."""
    rule: Rule
    tasks: tuple[str, ...] = ()
    """Tasks that it speaks of; where results hold nothing of one of them, the claim is not asked."""
    check_of_scene: bool = False
    """Whether the scene was chosen so that this holds: then it checks the scene and discovers nothing."""
