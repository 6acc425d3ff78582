"""Judge claims on results; print the table and write it as Markdown and JSON: `codesign-bench verify`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from codesign_bench.claims import agreement
from codesign_bench.claims.claim import Claim
from codesign_bench.claims.evidence import Evidence, load_evidence
from codesign_bench.claims.judging import Row, further_seeds, judge, missing
from codesign_bench.claims.page import P_VALUES, STATISTIC, Claimant, as_json, as_markdown, summary
from codesign_bench.console import Log, print_table, printer
from codesign_bench.errors import UserError
from codesign_bench.storage import provenance
from codesign_bench.storage.cells import find_cells
from codesign_bench.storage.files import Outputs, json_bytes
from codesign_bench.storage.places import shown

MARKDOWN_FILE, JSON_FILE = "claims.md", "claims.json"
AGREEMENT_MARKDOWN, AGREEMENT_JSON = "agreement.md", "agreement.json"


def verify(
    study: Claimant,
    results: Path,
    out: Path,
    console: Console,
    *,
    measure: bool = False,
    left_out: Sequence[str] = (),
    compared: Path | None = None,
) -> None:
    """Judge the claims of a study on the results folder, print the table and write it into `out`.

    With `measure`, outcomes that claims need but cells do not have are measured first, which takes minutes. `left_out`
    names the files that cannot be used; it is only written. `compared` is another results folder, on which the same
    claims are judged and compared.

    Raises:
        UserError: there are no results, they cannot be read, or `out` is not writable.
    """
    claims, log = study.claims(), printer(console)
    evidence = load_evidence(results)
    if measure:
        _measure(claims, evidence, results, log)
        evidence = load_evidence(results)
    rows = judge(claims, evidence, shown(results))
    made = _made(results)
    paths = write_rows(rows, study, results, out, made, left_out)
    print_rows(rows, console)
    if compared is not None:
        others = judge(claims, load_evidence(compared), shown(compared))
        paths += _agreement(agreement.pairs(rows, others), study, results, compared, out, console)
    for line in (*made, *map(str, paths)):
        log(line)


def _made(*folders: Path) -> list[str]:
    """Return how the cells of the folders were made otherwise."""
    return provenance.differences({shown(folder): provenance.records_of(find_cells(folder)) for folder in folders})


def _agreement(
    found: Sequence[agreement.Pair], study: Claimant, here: Path, there: Path, out: Path, console: Console
) -> list[Path]:
    """Print the claims that two results decide differently, write all into `out` and return the paths."""
    given = study, here, there, _made(here, there)
    paths = [out / AGREEMENT_JSON, out / AGREEMENT_MARKDOWN]
    with Outputs(f"--out {out}") as outputs:
        outputs.write(paths[0], json_bytes(agreement.as_json(found, *given)))
        outputs.write(paths[1], agreement.as_markdown(found, *given))
    differing = [pair.texts for pair in found if pair.agreement != agreement.SAME]
    if differing:
        print_table(console, agreement.HEADER, differing)
    printer(console)(f"here is {shown(here)}, there is {shown(there)}; {agreement.summary(found)}")
    return paths


def _measure(claims: Sequence[Claim], evidence: Evidence, results: Path, log: Log) -> None:
    """Measure what cells do not have, for every claim that is asked; log what cannot be measured."""
    for claim in claims:
        if claim.rule.measure is not None and set(claim.tasks) <= evidence.tasks:
            try:
                claim.rule.measure(results, log)
            except UserError as error:
                log(f"{claim.name} left out: {error}")


def print_rows(rows: Sequence[Row], console: Console) -> None:
    """Print one line per claim that is asked, then counts and commands for missing data and for further seeds.

    Checks of the scenes come after the other claims, claims without data last.
    """
    log = printer(console)
    ordered = sorted((row for row in rows if row.asked), key=lambda row: (bool(row.needs), row.claim.check_of_scene))
    table = [
        (row.finding.verdict, row.claim.name, row.interval, *row.p_values, row.finding.n, row.note) for row in ordered
    ]
    print_table(console, ("verdict", "claim", STATISTIC, *P_VALUES, "n", "note"), table)
    log(summary(rows))
    for command in missing(rows):
        log(f"needs: {command}")
    for command in further_seeds(rows):
        log(f"second look: {command}")


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
    given = study, results, made, left_out
    paths = [out / JSON_FILE, out / MARKDOWN_FILE]
    with Outputs(f"--out {out}") as outputs:
        outputs.write(paths[0], json_bytes(as_json(rows, *given)))
        outputs.write(paths[1], as_markdown(rows, *given))
    return paths
