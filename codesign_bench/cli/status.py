"""`codesign-bench status`: what a results folder holds and how far it is."""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path

from rich.console import Console

from codesign_bench.cli.arguments import add_results
from codesign_bench.console import print_table, printer
from codesign_bench.errors import UserError
from codesign_bench.storage.results import FAILED, cell_status, find_cells
from codesign_bench.storage.status import last_line, status_row

HELP = "what a results folder holds and how far it is"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the folder."""
    add_results(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Print one line per cell, the counts, and why cells failed."""
    print_status(console, options.results)
    return 0


def print_status(console: Console, out: Path) -> None:
    """Print one line per cell below `out`, the counts, and why cells failed.

    Raises:
        UserError: there is no such folder, or no cell in it.
    """
    cells = [(folder, content, cell_status(folder, content)) for folder, content in find_cells(out)]
    if not cells:
        raise UserError(f"no cells in '{out}' yet; make some with: codesign-bench run --out {out}")
    rows = [status_row(out, folder, content, status) for folder, content, status in cells]
    print_table(console, ("cell", "status", "env_steps", "of", "return", "success"), rows)
    counts = Counter(status for _, _, status in cells)
    summary = ", ".join(f"{count} {status}" for status, count in sorted(counts.items()))
    log = printer(console)
    log(f"{len(cells)} cells: {summary}")
    for folder, content, status in cells:
        if status == FAILED:
            log(f"{folder.relative_to(out)}: {last_line(content['failure'])}")
