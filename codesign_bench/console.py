"""Console output: lines, tables and the numbers in them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from typing import TypeAlias

from rich.console import Console
from rich.table import Table

from codesign_bench.visible_text import on_one_line, visible

Log: TypeAlias = Callable[[str], None]
"""A function that shows the user one line."""


def printer(console: Console) -> Log:
    """Return a function that prints a line verbatim: no markup, no colours, no truncation, no control sequences."""

    def log(line: str) -> None:
        console.print(visible(line), markup=False, highlight=False, soft_wrap=True)

    return log


def tell_left_out(lines: Iterable[str]) -> None:
    """Print on standard error what a command leaves out because it cannot be used."""
    for line in lines:
        with suppress(OSError, ValueError):  # the stream is closed or full
            print(f"left out: {on_one_line(line)}", file=sys.stderr)


def silent(line: str) -> None:
    """Show nothing."""


def number(value: float | None) -> str:
    """Return a number with two decimals, or an empty string for None."""
    return "" if value is None else f"{value:.2f}"


def duration(seconds: float) -> str:
    """Return seconds in the largest unit that fits: 45 s, 12 min, 3.5 h."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 90.0 * 60.0 else f"{seconds / 3600.0:.1f} h"


def print_table(console: Console, headings: Sequence[str], table_rows: Sequence[Sequence[str]]) -> None:
    """Print a table: with borders on a terminal, as aligned lines without truncation elsewhere."""
    table_rows = [[on_one_line(text) for text in row] for row in table_rows]
    if console.is_terminal:
        table = Table()
        for heading in headings:
            table.add_column(heading, overflow="fold")
        for row in table_rows:
            table.add_row(*row)
        console.print(table, markup=False, highlight=False)
        return
    widths = [max(len(text) for text in column) for column in zip(headings, *table_rows, strict=True)]
    for row in (headings, *table_rows):
        line = "  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip()
        console.print(line, markup=False, highlight=False, soft_wrap=True)
