"""Judge claims on results: one row for each claim, with p-values adjusted for all of its kind."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace

from codesign_bench import stats
from codesign_bench.claims.claim import Claim
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import NOT_ASKED, UNDECIDED, Finding, InsufficientData, probability
from codesign_bench.config.profiles import DEFAULT_PROFILE
from codesign_bench.seeding import generator

SEED = 0
"""Seed of permutations. Each claim has a separate random stream, so a new claim does not change other p-values."""


@dataclass(frozen=True)
class Row:
    """A claim and its finding."""

    claim: Claim
    finding: Finding
    needs: tuple[str, ...] = ()
    """Commands that produce missing data; empty if none are missing."""

    @property
    def asked(self) -> bool:
        """Whether there are results of every task of the claim."""
        return self.finding.verdict != NOT_ASKED

    @property
    def interval(self) -> str:
        """The statistic with its interval, as text."""
        if math.isnan(self.finding.value):
            return "-"
        value = _number(self.finding.value)
        if math.isnan(self.finding.low):
            return value
        return f"{value} [{_number(self.finding.low)}, {_number(self.finding.high)}]"

    @property
    def p_values(self) -> tuple[str, str]:
        """The p-value of this claim only, and the one adjusted for its family with the family's size, as text."""
        if math.isnan(self.finding.p):
            return "", ""
        return probability(self.finding.p), f"{probability(self.finding.p_adjusted)} ({self.finding.family_size})"


def judge(claims: Sequence[Claim], evidence: Evidence, results: str) -> list[Row]:
    """Judge each claim, then adjust p-values within each kind of rule (Holm).

    Args:
        claims: the claims that are judged together.
        evidence: their data.
        results: the folder in commands for missing data.
    """
    return adjusted([_row(claim, evidence, results) for claim in claims])


def adjusted(rows: Sequence[Row]) -> list[Row]:
    """Return the rows with p-values adjusted for each claim's looks and all claims with the same kind of rule."""
    families = defaultdict(list)
    for index, row in enumerate(rows):
        if not math.isnan(row.finding.p):
            families[row.claim.rule.kind].append(index)
    result = list(rows)
    for family in families.values():
        # Whichever look ends a claim, its p-value times the looks is valid, and Holm's method needs no more than that.
        adjusted_p = stats.holm([rows[index].claim.looks * rows[index].finding.p for index in family])
        for index, p in zip(family, adjusted_p, strict=True):
            finding = rows[index].finding.adjusted(float(p), len(family), rows[index].claim.looks)
            result[index] = replace(rows[index], finding=finding)
    return result


def _row(claim: Claim, evidence: Evidence, results: str) -> Row:
    profile = "" if evidence.profile == DEFAULT_PROFILE else f" --profile {evidence.profile}"
    needs = tuple(command.format(results=results, profile=profile) for command in claim.rule.needs)
    absent = [task for task in claim.tasks if task not in evidence.tasks]
    if absent:
        return Row(claim, Finding(NOT_ASKED, math.nan, note=f"no results of {', '.join(absent)}"), needs)
    try:
        return Row(claim, claim.rule.judge(evidence, generator(SEED, f"claim {claim.name}")))
    except InsufficientData as error:
        return Row(claim, Finding(UNDECIDED, math.nan, note=str(error)), needs)


def apart(rows: Sequence[Row]) -> tuple[list[Row], list[Row]]:
    """Return the rows that may find something out, and those that check the scenes."""
    found = [row for row in rows if not row.claim.check_of_scene]
    return found, [row for row in rows if row.claim.check_of_scene]


def missing(rows: Sequence[Row]) -> list[str]:
    """Return the commands that produce all missing data of the claims that are asked, without duplicates."""
    return list(dict.fromkeys(command for row in rows if row.asked for command in row.needs))


def _number(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else ("never" if value > 0.0 else "-inf")
