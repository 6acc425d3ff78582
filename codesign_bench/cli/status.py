"""`codesign-bench status`: list the cells in a results folder and their progress."""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path

from rich.console import Console

from codesign_bench.cli.arguments import add_results
from codesign_bench.console import print_table, printer, tell_left_out
from codesign_bench.errors import UserError
from codesign_bench.storage.cells import scan
from codesign_bench.storage.places import results_folder
from codesign_bench.storage.status import status_row
from codesign_bench.storage.survey import lines, survey

HELP = "list the cells in a results folder and their progress"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the results folder."""
    add_results(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Print one line per cell, the counts, and the errors of failed cells."""
    print_status(console, results_folder(options.results))
    return 0


def print_status(console: Console, out: Path) -> None:
    """Print one line per cell below `out`, the counts, the errors of failed cells, and what cannot be used.

    Raises:
        UserError: the folder does not exist, or contains no cells.
    """
    contents, log = scan(out), printer(console)
    cells = contents.cells
    tell_left_out(lines(out, survey(out, contents)))
    if not cells:
        raise UserError(f"no cells in '{out}' yet; run some with: codesign-bench run --out {out}")
    rows = [status_row(out, cell) for cell in cells]
    print_table(console, ("cell", "status", "env_steps", "of", "return", "success"), rows)
    counts = Counter(cell.status for cell in cells)
    log(f"{len(cells)} cells: {', '.join(f'{count} {status}' for status, count in sorted(counts.items()))}")
    for cell in cells:
        if cell.record.failure is not None:
            log(f"{cell.folder.relative_to(out)}: {cell.record.failure.last_line}")
