"""Console output: lines, tables and the numbers in them, and streams that may stop being read at any time.

For programs, all of it comes as lines of JSON instead, one event each.
"""

from __future__ import annotations

import errno
import json
import math
import os
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from datetime import datetime, timezone
from typing import IO, Any, TypeAlias, cast

from rich.console import Console
from rich.table import Table

from codesign_bench.visible_text import on_one_line, visible

Log: TypeAlias = Callable[[str], None]
"""A function that shows the user one line."""


class JsonLines(Console):
    """A console that writes events, each a JSON object on a line: the lines and tables of others, and numbers.

    Every event has `event`, its kind, and `time`, UTC in ISO 8601.
    """

    def __init__(self, stream: Any = None) -> None:
        super().__init__(file=cast(IO[str], sys.stdout if stream is None else stream), force_terminal=False)
        self._lock_of_lines = threading.Lock()

    def event(self, kind: str, values: Mapping[str, Any]) -> None:
        """Write an event."""
        time = datetime.now(timezone.utc).isoformat(timespec="milliseconds")
        line = json.dumps(_plain({"event": kind, "time": time, **values}), allow_nan=False)
        with self._lock_of_lines:
            self.file.write(f"{line}\n")
            self.file.flush()


def _plain(value: Any) -> Any:
    """Return a value that JSON can hold: numbers of other libraries as Python's, those that are not finite as null."""
    if isinstance(value, Mapping):
        return {str(name): _plain(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    if isinstance(value, str | bool | int) or value is None:
        return value
    if isinstance(value, float) or hasattr(value, "__float__"):
        number = float(value)
        return number if math.isfinite(number) else None
    return str(value)


def tell(console: Console, kind: str, **values: Any) -> bool:
    """Write an event if this console writes JSON; return whether it does."""
    if isinstance(console, JsonLines):
        console.event(kind, values)
        return True
    return False


@contextmanager
def json_lines() -> Iterator[JsonLines]:
    """Return a console that writes JSON to standard output, and nothing else gets there: it goes to standard error.

    Libraries of others print to standard output, some of them without Python.
    """
    try:
        number = sys.stdout.fileno()
        own = os.dup(number)
    except (OSError, ValueError, AttributeError):  # it is no file, as in tests
        yield JsonLines()
        return
    before, sys.stdout = sys.stdout, sys.stderr
    os.dup2(sys.__stderr__.fileno() if sys.__stderr__ else 2, number)
    stream = SteadyStream(os.fdopen(os.dup(own), "w", encoding="utf-8"))
    try:
        yield JsonLines(stream)
    finally:
        stream.flush()
        stream.close()
        sys.stdout = before
        os.dup2(own, number)
        os.close(own)


def printer(console: Console) -> Log:
    """Return a function that prints a line verbatim: no markup, no colours, no truncation, no control sequences."""
    if isinstance(console, JsonLines):
        events = console
        return lambda line: events.event("message", {"text": line})

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
    """Print a table: with borders on a terminal, as aligned lines without truncation elsewhere, as events in JSON."""
    if isinstance(console, JsonLines):
        for row in table_rows:
            console.event("row", dict(zip(headings, row, strict=True)))
        return
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
