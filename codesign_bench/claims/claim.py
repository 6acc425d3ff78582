"""A claim, and the rule that judges it."""

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
    """How a claim is judged; written down before any result is seen."""

    kind: str
    """Name of the rule in docs/claims.md, which explains it."""
    statistic: str
    """The statistic, in a few words."""
    words: str
    """When the statistic supports the claim and when it contradicts it."""
    needs: tuple[str, ...]
    """Commands that produce the data; `{results}` is the results folder, `{profile}` its option or nothing,
    `{seeds[6]}` the value of `--seeds` for the first six seeds of the folder, and `{seed[0]:02d}` the first of them."""
    judge: Callable[[Evidence, np.random.Generator], Finding]
    """The rule itself; raises `InsufficientData` if data are missing."""
    measure: Callable[[Path, Log], object] | None = None
    """Measures missing data that are not in cells by playing finished policies or scripts; may take minutes."""


@dataclass(frozen=True)
class Claim:
    """One finding of a study, with the rule that judges it."""

    name: str
    """Unique name for tables and files."""
    sentence: str
    """The claim, in our words."""
    source: str
    """Section, figure or table of a publication, or "ours"."""
    rule: Rule
    tasks: tuple[str, ...] = ()
    """Tasks of the claim; without results of all of them, the claim is not asked."""
    check_of_scene: bool = False
    """Whether the scene was chosen so that the claim holds; the claim then checks the scene and is no discovery."""
    adds_seeds_of: tuple[str, ...] = ()
    """Methods that get more seeds on the claim's only task if the first look leaves it undecided, not at a ceiling and
    not shown to be equivalent; empty if it asks for none."""
    looks: int = 1
    """How many times it may be judged while seeds are added. The p-value counts as often (Bonferroni): one that is
    read at every look falls below a level by luck more often than one that is read once."""
