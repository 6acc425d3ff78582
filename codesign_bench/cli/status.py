"""`codesign-bench status`: list the cells in a results folder and their progress."""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Annotated

from rich.console import Console

from codesign_bench.cli.arguments import OfKind, add_json, add_results
from codesign_bench.config.values import Within
from codesign_bench.console import JsonLines, print_table, printer, tell_left_out
from codesign_bench.errors import UserError
from codesign_bench.storage.cells import scan
from codesign_bench.storage.layout import first_run
from codesign_bench.storage.places import results_folder
from codesign_bench.storage.records import RUNNING
from codesign_bench.storage.status import status_event, status_row
from codesign_bench.storage.survey import lines, survey

HELP = "list the cells in a results folder and their progress"
Interval = Annotated[float, Within(0.1, 86_400.0)]
WATCH_SECONDS = 5.0
IDLE_SECONDS = 30.0
"""Watching ends when no cell has been running for so long: between two cells of a sweep, none is for some seconds."""
LOOK_SHARE = 0.1
"""A look takes at most this share of the time, however many cells there are: a sweep needs the rest."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the results folder."""
    add_results(parser)
    add_json(parser)
    parser.add_argument(
        "--watch",
        nargs="?",
        type=OfKind(Interval),
        const=WATCH_SECONDS,
        metavar="SECONDS",
        help=f"look again every so many seconds (default: {WATCH_SECONDS:g}), until no cell is running or Ctrl-C",
    )


def run(options: argparse.Namespace, console: Console) -> int:
    """Print one line per cell, the counts, and the errors of failed cells; with `--watch`, again and again."""
    results = results_folder(options.results)
    if options.watch is None:
        print_status(console, results)
    else:
        watch(console, results, options.watch)
    return 0


def watch(console: Console, out: Path, seconds: float, pause: Callable[[float], object] = time.sleep) -> None:
    """Print the status every `seconds`, until no cell has been running for `IDLE_SECONDS`, or Ctrl-C.

    Raises:
        UserError: the folder does not exist, or contains no cells.
    """
    idle = 0.0
    with suppress(KeyboardInterrupt):
        while True:
            began = time.monotonic()
            running = print_status(console, out, clear=True)
            wait = max(seconds, (time.monotonic() - began) / LOOK_SHARE)
            idle = 0.0 if running else idle + wait
            if idle > IDLE_SECONDS:
                printer(console)(f"no cell has been running for {IDLE_SECONDS:.0f} s")
                return
            pause(wait)


def print_status(console: Console, out: Path, *, clear: bool = False) -> int:
    """Print one line per cell below `out`, the counts, the errors of failed cells, and what cannot be used.

    Return how many cells are running. With `clear`, a terminal is cleared first.

    Raises:
        UserError: the folder does not exist, or contains no cells.
    """
    contents, log = scan(out), printer(console)
    cells = contents.cells
    left_out = lines(out, survey(out, contents))
    rows = [status_row(out, cell) for cell in cells]
    if clear:
        console.clear()
    tell_left_out(left_out)
    if not cells:
        raise UserError(f"no cells in '{out}' yet; run some with: {first_run(out)}")
    counts = Counter(cell.status for cell in cells)
    if isinstance(console, JsonLines):
        for cell in cells:
            console.event("cell", status_event(out, cell))
        console.event("status", {"cells": len(cells), **counts})
        return counts[RUNNING]
    print_table(console, ("cell", "status", "env_steps", "of", "return", "success"), rows)
    log(f"{len(cells)} cells: {', '.join(f'{count} {status}' for status, count in sorted(counts.items()))}")
    for cell in cells:
        if cell.record.failure is not None:
            log(f"{cell.folder.relative_to(out)}: {cell.record.failure.last_line}")
    return counts[RUNNING]
