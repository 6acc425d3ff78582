"""Judge claims on results; print the table and write it as Markdown and JSON."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

from rich.console import Console

from codesign_bench import __version__, stats
from codesign_bench.claims.claim import Claim
from codesign_bench.claims.evidence import Evidence, load_evidence
from codesign_bench.claims.finding import (
    CONTRADICTED,
    LEVEL,
    NOT_ASKED,
    UNDECIDED,
    VERDICTS,
    Finding,
    InsufficientData,
    probability,
)
from codesign_bench.config.profiles import DEFAULT_PROFILE
from codesign_bench.console import Log, print_table, printer
from codesign_bench.errors import UserError
from codesign_bench.seeding import generator
from codesign_bench.storage import provenance
from codesign_bench.storage.cells import find_cells
from codesign_bench.storage.files import Outputs, json_bytes
from codesign_bench.storage.places import shown
from codesign_bench.text_tables import markdown, plain_markdown
from codesign_bench.visible_text import on_one_line

MARKDOWN_FILE, JSON_FILE = "claims.md", "claims.json"
SEED = 0
"""Seed of permutations. Each claim has a separate random stream, so a new claim does not change other p-values."""

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


def verify(
    study: Claimant,
    results: Path,
    out: Path,
    console: Console,
    *,
    measure: bool = False,
    left_out: Sequence[str] = (),
) -> None:
    """Judge the claims of a study on the results folder, print the table and write it into `out`.

    With `measure`, outcomes that claims need but cells do not have are measured first, which takes minutes. `left_out`
    names the files that cannot be used; it is only written.

    Raises:
        UserError: there are no results, they cannot be read, or `out` is not writable.
    """
    claims, log = study.claims(), printer(console)
    evidence = load_evidence(results)
    if measure:
        _measure(claims, evidence, results, log)
        evidence = load_evidence(results)
    rows = judge(claims, evidence, shown(results))
    made = provenance.differences({results.name: provenance.records_of(find_cells(results))})
    paths = write_rows(rows, study, results, out, made, left_out)
    print_rows(rows, console)
    for line in (*made, *map(str, paths)):
        log(line)


def _measure(claims: Sequence[Claim], evidence: Evidence, results: Path, log: Log) -> None:
    """Measure what cells do not have, for every claim that is asked; log what cannot be measured."""
    for claim in claims:
        if claim.rule.measure is not None and set(claim.tasks) <= evidence.tasks:
            try:
                claim.rule.measure(results, log)
            except UserError as error:
                log(f"{claim.name} left out: {error}")


def print_rows(rows: Sequence[Row], console: Console) -> None:
    """Print one line per claim that is asked, then counts and commands for missing data.

    Checks of the scenes come after the other claims, claims without data last.
    """
    log = printer(console)
    ordered = sorted((row for row in rows if row.asked), key=lambda row: (bool(row.needs), row.claim.check_of_scene))
    table = [
        (row.finding.verdict, row.claim.name, row.interval, *row.p_values, row.finding.n, row.finding.note)
        for row in ordered
    ]
    print_table(console, ("verdict", "claim", STATISTIC, *P_VALUES, "n", "note"), table)
    for line in (summary(rows), *(f"needs: {command}" for command in missing(rows))):
        log(line)


def summary(rows: Sequence[Row]) -> str:
    """Return the counts of verdicts as one line, those of checks of the scenes after the others."""
    asked = [row for row in rows if row.asked]
    found, checks = apart(asked)
    lacking = sum(bool(row.needs) for row in asked)
    told = f"{len(found)} claims: {_counted(found)}"
    told += f"; {len(checks)} checks of the scenes: {_counted(checks)}" if checks else ""
    tasks = dict.fromkeys(task for row in rows if not row.asked for task in row.claim.tasks)
    others = f"; {len(rows) - len(asked)} more not asked, without results of all of {', '.join(tasks)}" if tasks else ""
    return f"{told} ({lacking} undecided for lack of data){others}"


def apart(rows: Sequence[Row]) -> tuple[list[Row], list[Row]]:
    """Return the rows that may find something out, and those that check the scenes."""
    found = [row for row in rows if not row.claim.check_of_scene]
    return found, [row for row in rows if row.claim.check_of_scene]


def _counted(rows: Sequence[Row]) -> str:
    counts = Counter(row.finding.verdict for row in rows)
    return ", ".join(f"{counts[verdict]} {verdict}" for verdict in VERDICTS)


def missing(rows: Sequence[Row]) -> list[str]:
    """Return the commands that produce all missing data of the claims that are asked, without duplicates."""
    return list(dict.fromkeys(command for row in rows if row.asked for command in row.needs))


def write_rows(
    rows: Sequence[Row],
    study: Claimant,
    results: Path,
    out: Path,
    made: Sequence[str] = (),
    left_out: Sequence[str] = (),
) -> list[Path]:
    """Write the rows as Markdown and JSON into `out`, both or none, and return the paths.

    `made` tells how cells were made otherwise, `left_out` which files cannot be used.

    Raises:
        UserError: `out` is not writable.
    """
    told = study, results, made, left_out
    paths = [out / JSON_FILE, out / MARKDOWN_FILE]
    with Outputs(f"--out {out}") as outputs:
        outputs.write(paths[0], json_bytes(as_json(rows, *told)))
        outputs.write(paths[1], as_markdown(rows, *told))
    return paths


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
        "claims": [_entry(row) for row in found],
        "checks_of_scenes": [_entry(row) for row in checks],
    }


def _entry(row: Row) -> dict[str, Any]:
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
        "note": row.finding.note,
        "needs": list(row.needs),
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
    if missing(rows):
        parts += ["## Data that are missing\n", "```\n" + "\n".join(map(on_one_line, missing(rows))) + "\n```\n"]
    return "\n".join(parts)


HOW_SURE = (
    "p-values are two-sided. The adjusted ones count each p-value as often as its claim may be judged while seeds are "
    "added, and account by Holm's method for all claims of the same rule, whose number is in brackets; a verdict that "
    f"follows from a test needs one below {LEVEL:g}. Fewer than {stats.MIN_SEEDS} seeds give no interval and decide "
    "nothing."
)
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
            "; ".join(filter(None, [row.finding.note, *(f"needs: `{command}`" for command in row.needs)])),
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
        plain_markdown(
            f"- {row.claim.sentence}: {row.interval} ({'; '.join(filter(None, (row.finding.n, row.finding.note)))})"
        )
        for row in rows
        if row.finding.verdict == CONTRADICTED
    ]
    return "\n".join(lines or ["None."]) + "\n"


def _number(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else ("never" if value > 0.0 else "-inf")


def _json_number(value: float) -> float | str | None:
    if math.isfinite(value):
        return value
    return None if math.isnan(value) else ("inf" if value > 0.0 else "-inf")
