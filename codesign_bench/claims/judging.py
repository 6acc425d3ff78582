"""Judge claims on results: one row for each claim, with p-values adjusted for all of its kind."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from codesign_bench import stats
from codesign_bench.claims.claim import Claim
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import NOT_ASKED, UNDECIDED, Finding, InsufficientData, joined, probability
from codesign_bench.config.profiles import DEFAULT_PROFILE
from codesign_bench.seeding import TUNING_SEEDS, generator

SEED = 0
"""Seed of permutations. Each claim has a separate random stream, so a new claim does not change other p-values."""

ALL_SEEDS = 10
"""Seeds of a method at the second and last look (ours)."""


@dataclass(frozen=True)
class Row:
    """A claim and its finding."""

    claim: Claim
    finding: Finding
    needs: tuple[str, ...] = ()
    """Commands that produce missing data; empty if none are missing."""
    further_seeds: str = ""
    """Command that adds seeds where the first look left the claim undecided; empty if it asks for none."""
    awaits: tuple[str, ...] = ()
    """Tasks of a claim with several looks on which seeds of the last one are missing: its verdict is not final."""

    @property
    def asked(self) -> bool:
        """Whether there are results of every task of the claim."""
        return self.finding.verdict != NOT_ASKED

    @property
    def note(self) -> str:
        """The remark on the finding, and that a verdict with a p-value is not final while seeds are missing."""
        if not self.awaits or math.isnan(self.finding.p):
            return self.finding.note
        where = f": seeds are missing on {', '.join(self.awaits)}" if len(self.claim.tasks) > 1 else ""
        return joined(self.finding.note, f"not final{where}")

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
    rows = adjusted([_row(claim, evidence, results) for claim in claims])
    rows = [replace(row, further_seeds=_further_seeds(row, evidence, results)) for row in rows]
    # Seeds that one claim asks for are data of every claim about the task, so all of these are judged again. Until then
    # they may be read more often than their looks count, above all a claim over several tasks whose seeds come one task
    # after another.
    open_tasks = {task for row in rows if row.further_seeds for task in row.claim.tasks}
    return [replace(row, awaits=_awaits(row, open_tasks)) for row in rows]


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
    needs = tuple(_filled(command, evidence, results) for command in claim.rule.needs)
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


def further_seeds(rows: Sequence[Row]) -> list[str]:
    """Return the commands that add seeds for a second look, without duplicates."""
    return list(dict.fromkeys(row.further_seeds for row in rows if row.further_seeds))


def _awaits(row: Row, open_tasks: Collection[str]) -> tuple[str, ...]:
    """Return the tasks of a claim with several looks that wait for seeds of the last one."""
    return tuple(task for task in row.claim.tasks if task in open_tasks) if row.claim.looks > 1 else ()


def _further_seeds(row: Row, evidence: Evidence, results: str) -> str:
    """Return the command that adds the seeds of the second look; empty if nothing is left to decide or to add."""
    methods, finding = row.claim.adds_seeds_of, row.finding
    if not methods or row.needs or finding.verdict != UNDECIDED or finding.equivalent:
        return ""
    (task,) = row.claim.tasks
    fewest = min((evidence.seeds(task, method) for method in methods), key=len)
    if not 0 < len(fewest) < ALL_SEEDS:
        return ""
    # Settings were chosen on the tuning seeds, so none of those may be added to what is reported.
    first = max(fewest[-1] + 1, TUNING_SEEDS.stop)
    seeds = f"{first}-{first + ALL_SEEDS - len(fewest) - 1}"
    return (
        f"codesign-bench run --method {' '.join(methods)} --task {task} --seeds {seeds}{_profile(evidence)} "
        f"--out {results}"
    )


def _filled(command: str, evidence: Evidence, results: str) -> str:
    """Return a command of `Rule.needs` with its placeholders filled."""
    first = evidence.first_seed
    numbers = range(first, first + ALL_SEEDS)
    return command.format(results=results, profile=_profile(evidence), seeds=_FirstSeeds(first), seed=numbers)


@dataclass(frozen=True)
class _FirstSeeds:
    """`{seeds[6]}` is the value of `--seeds` for the first six seeds of a folder."""

    first: int

    def __getitem__(self, count: int) -> str:
        return f"{self.first}-{self.first + count - 1}" if self.first else str(count)


def _profile(evidence: Evidence) -> str:
    return "" if evidence.profile == DEFAULT_PROFILE else f" --profile {evidence.profile}"


def _number(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else ("never" if value > 0.0 else "-inf")
