"""A study's claims for the page: the finding on each, and its rule."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from codesign_bench.claims.evidence import load_evidence
from codesign_bench.claims.judging import Row, apart, judge, missing
from codesign_bench.claims.page import P_VALUES, STATISTIC, summary
from codesign_bench.errors import UserError
from codesign_bench.study.study import Study

from .tables import NOTHING, Table


@dataclass(frozen=True)
class ClaimsPart:
    """The part of the page on claims."""

    summary: str
    table: Table | None
    """The claims with data; None if there are none."""
    checks: Table | None
    """The same for claims that check the scenes."""
    rules: Table | None
    """How these claims were judged."""
    lacking: Table | None
    """The claims without data."""
    commands: list[str]
    """Commands that produce the missing data."""


def claims_part(results: Path, study: Study) -> ClaimsPart:
    """Judge the claims of a study on the folder `results`."""
    try:
        return part(judge(study.claims(), load_evidence(results), str(results)))
    except UserError as error:  # no finished cell yet, or an unreadable table
        return ClaimsPart(f"No claim was judged: {error}", None, None, None, None, [])


def part(rows: Sequence[Row]) -> ClaimsPart:
    """Return judged claims for the page: those with data first, those without below, collapsed."""
    with_data = [row for row in rows if not row.needs]
    without = [row for row in rows if row.asked and row.needs]
    found, checks = ([_shown(row) for row in rows] for rows in apart(with_data))
    rules = {row.claim.rule.kind: (row.claim.rule.statistic, row.claim.rule.words) for row in with_data}
    return ClaimsPart(
        summary=summary(rows) + ".",
        table=_table(found),
        checks=_table(checks),
        rules=Table(("rule", "statistic", "verdict"), [(kind, *told) for kind, told in rules.items()])
        if rules
        else None,
        lacking=Table(("claim", "why"), [(row.claim.sentence, row.finding.note) for row in without])
        if without
        else None,
        commands=missing(rows),
    )


def _shown(row: Row) -> tuple[str, ...]:
    found = row.finding
    n, rule = found.n or NOTHING, row.claim.rule.kind
    return found.verdict, row.claim.sentence, row.interval, *row.p_values, n, rule, found.note


def _table(rows: Sequence[tuple[str, ...]]) -> Table | None:
    return Table(("verdict", "claim", STATISTIC, *P_VALUES, "of", "rule", "note"), rows) if rows else None
