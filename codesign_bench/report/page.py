"""Summarise a results folder in one HTML page that needs no other file and no network.

The page has no scripts, and all content of results is escaped: a traceback or a label is never markup.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path

import jinja2
import pandas as pd
from markupsafe import Markup, escape

from codesign_bench.code_version import code_version
from codesign_bench.console import Log
from codesign_bench.errors import UserError
from codesign_bench.stats import CELL_KEYS
from codesign_bench.storage.files import make_folder, removed_if_refused, write_output
from codesign_bench.storage.frames import stored_curves
from codesign_bench.storage.layout import CURVE_COLUMNS
from codesign_bench.storage.provenance import differences
from codesign_bench.study.study import DEFAULT_STUDY, Study, load_study
from codesign_bench.visible_text import visible

from . import cells as cell_parts
from . import provenance
from .cells import CellFailure, PageCell, read_cells
from .claims import ClaimsPart, claims_part
from .figures import FigurePart, figure_parts
from .final_values import STRIP_WIDTH, TaskResult, task_results
from .tables import Table, number

ENDINGS = (".html", ".htm")
TEMPLATE = "page.html.j2"


@dataclass(frozen=True)
class Page:
    """The content of the page, in order."""

    study: Study
    """The study of its figures and claims."""
    facts: list[tuple[str, str]]
    results: list[TaskResult]
    claims: ClaimsPart
    figures: list[FigurePart]
    left_out: list[str]
    """Why some figures are missing."""
    status: Table
    failures: list[CellFailure]
    damaged: list[str]
    """Files that cannot be used, each with its reason."""
    cells: Table
    configurations: list[provenance.Configuration]
    differences: list[str]
    """How cells were made otherwise than others, where it can change numbers: a heading and a line per kind."""
    commits: Table
    versions: Table
    machines: Table
    times: Table
    period: str
    code: str
    made: str


def write_report(results: Path, out: Path, log: Log, study: Study | None = None) -> None:
    """Write the page on everything below `results` to the file `out`, and log its path.

    Args:
        results: a results folder.
        out: an HTML file.
        log: prints the path.
        study: the study of the page's figures and claims; None: the default one.

    Raises:
        UserError: the folder does not exist or has no cells, or `out` is not writable.
    """
    if out.suffix.lower() not in ENDINGS:
        raise UserError(f"--out {out}: the file must end in {ENDINGS[0]}")
    if out.is_dir():
        raise UserError(f"--out {out}: is a folder; give a file in it, e.g. {out / 'report.html'}")
    cells, damaged = read_cells(results)
    with removed_if_refused(out.parent):
        make_folder(f"--out {out}", out.parent)
        page = gather(results, cells, damaged, study or load_study(DEFAULT_STUDY))
        write_output(f"--out {out}", out, render(page))
    log(str(out))


def gather(results: Path, cells: Sequence[PageCell], damaged: list[str], study: Study) -> Page:
    """Return the content of the page on the folder `results` and its cells from `read_cells`."""
    left_out: list[str] = []
    return Page(
        study=study,
        facts=cell_parts.facts(results, cells),
        results=task_results(cells, _curves(results)),
        claims=claims_part(results, study),
        figures=figure_parts(results, study, left_out.append),
        left_out=left_out,
        status=cell_parts.status_table(cells),
        failures=cell_parts.failures(cells),
        damaged=damaged,
        cells=cell_parts.cell_table(cells),
        configurations=provenance.configurations(cells),
        differences=differences({results.name: [cell.record for cell in cells]}),
        commits=provenance.code_table(cells),
        versions=provenance.version_table(cells),
        machines=provenance.machine_table(cells),
        times=provenance.time_table(cells),
        period=provenance.period(cells),
        code=str(code_version()),
        made=datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
    )


def render(page: Page) -> str:
    """Return the page as HTML."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("codesign_bench.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(number=number, code=code_spans)
    return visible(environment.get_template(TEMPLATE).render(page=page, strip_width=STRIP_WIDTH))


def code_spans(text: str) -> Markup:
    """Return `text` as HTML, with text between backticks as code."""
    parts = text.split("`")
    if len(parts) % 2 == 0:  # an unpaired backtick
        return escape(text)
    spans = (Markup("<code>{}</code>").format(part) if index % 2 else escape(part) for index, part in enumerate(parts))
    return Markup("").join(spans)


def _curves(results: Path) -> pd.DataFrame:
    """Return the curves of all cells; empty if no cell has been evaluated."""
    try:
        return stored_curves(results)
    except UserError:
        return pd.DataFrame(columns=[*CELL_KEYS, "seed", *CURVE_COLUMNS])
