"""Console output: lines, tables and the numbers in them, and streams that may stop being read at any time."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any, TypeAlias

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


class SteadyStream:
    """A text stream that never fails: what cannot be written is lost, and the program goes on.

    So a sweep does not end because nobody reads its output any more, or because the disk behind it is full.
    """

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self.fault: OSError | ValueError | None = None
        """Why nothing is written any more."""

    def write(self, text: str) -> int:
        """Write `text`; characters that the stream's encoding does not have are written as escapes."""
        try:
            if self.fault is None:
                self._stream.write(text)
        except UnicodeEncodeError as error:
            self.write(text.encode(error.encoding, "backslashreplace").decode(error.encoding))
        except (OSError, ValueError) as error:
            self._give_up(error)
        return len(text)

    def flush(self) -> None:
        """Write what is buffered."""
        try:
            if self.fault is None:
                self._stream.flush()
        except (OSError, ValueError) as error:
            self._give_up(error)

    def _give_up(self, error: OSError | ValueError) -> None:
        self.fault = error
        try:  # What is still buffered goes nowhere, or Python would try to write it once more when it ends.
            nothing = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nothing, self._stream.fileno())
            os.close(nothing)
        except (OSError, ValueError):
            pass

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    @property
    def loss(self) -> str:
        """Why output was lost although somebody may still want it, or nothing."""
        number = getattr(self.fault, "errno", None)
        return "" if self.fault is None or number in (None, errno.EPIPE, errno.EBADF) else os.strerror(int(number or 0))


@contextmanager
def steady_streams(program: str) -> Iterator[None]:
    """Make writing to standard output and standard error never fail; at the end, say once what was lost and why."""
    before = sys.stdout, sys.stderr
    output, errors = SteadyStream(sys.stdout), SteadyStream(sys.stderr)
    sys.stdout, sys.stderr = output, errors
    try:
        yield
    finally:
        output.flush()
        if output.loss:
            errors.write(f"{program}: the output could not be written ({output.loss}); all else was done\n")
        errors.flush()
        sys.stdout, sys.stderr = before
