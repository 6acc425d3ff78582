"""Judged claims as text: the page in Markdown, and the same as JSON values."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol

from codesign_bench import __version__, stats
from codesign_bench.claims.claim import Claim
from codesign_bench.claims.finding import CONTRADICTED, LEVEL, VERDICTS
from codesign_bench.claims.judging import Row, apart, further_seeds, missing
from codesign_bench.storage import provenance
from codesign_bench.storage.places import shown
from codesign_bench.text_tables import markdown, plain_markdown
from codesign_bench.visible_text import on_one_line

STATISTIC, P_VALUES = "statistic [95 % interval]", ("p", "adjusted p (claims)")
"""Headings of tables."""


class Claimant(Protocol):
    """A source of claims, i.e. a study."""

    @property
    def name(self) -> str:
        """Short name."""

    @property
    def title(self) -> str:
        """Name in headings."""

    @property
    def claims(self) -> Callable[[], Sequence[Claim]]:
        """Returns the claims."""


def summary(rows: Sequence[Row]) -> str:
    """Return the counts of verdicts as one line, those of checks of the scenes after the others."""
    asked = [row for row in rows if row.asked]
    found, checks = apart(asked)
    lacking = sum(bool(row.needs) for row in asked)
    counts = f"{len(found)} claims: {_counted(found)}"
    counts += f"; {len(checks)} checks of the scenes: {_counted(checks)}" if checks else ""
    tasks = dict.fromkeys(task for row in rows if not row.asked for task in row.claim.tasks)
    others = f"; {len(rows) - len(asked)} more not asked, without results of all of {', '.join(tasks)}" if tasks else ""
    return f"{counts} ({lacking} undecided for lack of data){others}"


def _counted(rows: Sequence[Row]) -> str:
    counts = Counter(row.finding.verdict for row in rows)
    return ", ".join(f"{counts[verdict]} {verdict}" for verdict in VERDICTS)


def as_json(
    rows: Sequence[Row], study: Claimant, results: Path, made: Sequence[str] = (), left_out: Sequence[str] = ()
) -> dict[str, Any]:
    """Return everything that is known of each claim, as JSON values; what is not finite is None or text."""
    found, checks = apart(rows)
    return {
        "version": __version__,
        "study": study.name,
        "results": shown(results),
        "made": list(made),
        "left_out": list(left_out),
        "interval": {"confidence": stats.CONFIDENCE},
        "adjustment": {"method": "Holm", "level": LEVEL, "family": "claims of one rule that have a p-value"},
        "claims": [entry(row) for row in found],
        "checks_of_scenes": [entry(row) for row in checks],
    }


def entry(row: Row) -> dict[str, Any]:
    """Return everything that is known of one claim, as JSON values."""
    return {
        "name": row.claim.name,
        "sentence": row.claim.sentence,
        "source": row.claim.source,
        "tasks": list(row.claim.tasks),
        "rule": row.claim.rule.kind,
        "statistic": row.claim.rule.statistic,
        "words": row.claim.rule.words,
        "looks": row.claim.looks,
        "verdict": row.finding.verdict,
        "value": _json_number(row.finding.value),
        "low": _json_number(row.finding.low),
        "high": _json_number(row.finding.high),
        "p": _json_number(row.finding.p),
        "p_adjusted": _json_number(row.finding.p_adjusted),
        "family_size": row.finding.family_size,
        "n": row.finding.n,
        "note": row.note,
        "needs": list(row.needs),
        "further_seeds": row.further_seeds,
        "awaits": list(row.awaits),
    }


def as_markdown(
    rows: Sequence[Row], study: Claimant, results: Path, made: Sequence[str] = (), left_out: Sequence[str] = ()
) -> str:
    """Return the page: the tables of claims, the rules that judged them, and the commands for missing data."""
    asked = [row for row in rows if row.asked]
    found, checks = apart(asked)
    rules = {row.claim.rule.kind: (row.claim.rule.statistic, row.claim.rule.words) for row in asked}
    parts = [
        f"# {study.title}: what the results say of its claims\n",
        f"Results: `{on_one_line(shown(results))}`. {plain_markdown(summary(rows))}. {HOW_SURE}\n",
        by_rule(asked),
        "## Contradicted\n",
        contradicted(asked),
        "## Every claim\n",
        _claims_table(found),
    ]
    if checks:
        parts += ["## Checks of the scenes\n", f"{SCENES}\n", _claims_table(checks)]
    parts += [
        "## Rules\n",
        markdown(("rule", "statistic", "verdict"), [(kind, *words) for kind, words in rules.items()]),
    ]
    if made:
        parts += ["## How the cells were made\n", provenance.as_markdown(made)]
    if left_out:
        parts += ["## Files that cannot be used\n", "\n".join(f"- {plain_markdown(line)}" for line in left_out) + "\n"]
    for heading, commands in (("Data that are missing", missing(rows)), (SECOND_LOOK, further_seeds(rows))):
        if commands:
            parts += [f"## {heading}\n", "```\n" + "\n".join(map(on_one_line, commands)) + "\n```\n"]
    return "\n".join(parts)


HOW_SURE = (
    "p-values are two-sided. The adjusted ones count each p-value as often as its claim may be judged while seeds are "
    "added, and account by Holm's method for all claims of the same rule, whose number is in brackets; a verdict that "
    f"follows from a test needs one below {LEVEL:g}. Fewer than {stats.MIN_SEEDS} seeds give no interval and decide "
    "nothing. A verdict is not final while seeds of its claim's last look are missing on its tasks."
)
SECOND_LOOK = "Seeds for a second look at what is undecided"
SCENES = (
    "The scenes were chosen so that one tool does not serve all goals. That no single tool does, and that methods with "
    "one tool for all goals fall behind, shows that the scenes are as intended; it is no discovery about a method."
)


def _claims_table(rows: Sequence[Row]) -> str:
    header = ("claim", "verdict", STATISTIC, *P_VALUES, "n", "rule", "source", "note")
    table = [
        (
            row.claim.sentence,
            f"*{row.finding.verdict}*",
            row.interval,
            *row.p_values,
            row.finding.n,
            row.claim.rule.kind,
            row.claim.source,
            "; ".join(filter(None, [row.note, *(f"needs: `{command}`" for command in row.needs)])),
        )
        for row in rows
    ]
    return markdown(header, table)


def by_rule(rows: Sequence[Row]) -> str:
    """Return a Markdown table with the number of claims per rule and verdict, checks of the scenes last."""
    found, checks = apart(rows)
    table = [*_by_rule(found, ""), *_by_rule(checks, " (check of the scene)")]
    return markdown(("rule", *VERDICTS), table)


def _by_rule(rows: Sequence[Row], mark: str) -> list[tuple[str, ...]]:
    counts = Counter((row.claim.rule.kind, row.finding.verdict) for row in rows)
    kinds = dict.fromkeys(row.claim.rule.kind for row in rows)
    return [(f"{kind}{mark}", *(str(counts[kind, verdict]) for verdict in VERDICTS)) for kind in kinds]


def contradicted(rows: Sequence[Row]) -> str:
    """Return a Markdown list of the claims that the results contradict, with their findings."""
    lines = [
        plain_markdown(f"- {row.claim.sentence}: {row.interval} ({'; '.join(filter(None, (row.finding.n, row.note)))})")
        for row in rows
        if row.finding.verdict == CONTRADICTED
    ]
    return "\n".join(lines or ["None."]) + "\n"


def _json_number(value: float) -> float | str | None:
    if math.isfinite(value):
        return value
    return None if math.isnan(value) else ("inf" if value > 0.0 else "-inf")
