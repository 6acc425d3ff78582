"""What the user reads: numbers in words."""

from __future__ import annotations

import errno
import io
import sys

import pytest
from rich.console import Console

from codesign_bench.console import duration, number, printer, steady_streams


def test_durations_have_the_largest_unit_that_fits() -> None:
    assert [duration(seconds) for seconds in (42, 600, 12_600)] == ["42 s", "10 min", "3.5 h"]


def test_numbers_have_two_decimals_and_nothing_stands_for_none() -> None:
    assert [number(1.234), number(None)] == ["1.23", ""]


class Broken(io.StringIO):
    """A stream that cannot be written."""

    def __init__(self, error: Exception) -> None:
        super().__init__()
        self.error = error

    def write(self, text: str) -> int:
        raise self.error


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (BrokenPipeError(errno.EPIPE, "Broken pipe"), ""),
        (OSError(errno.EBADF, "Bad file descriptor"), ""),
        (OSError(errno.ENOSPC, "No space left on device"), "prog: the output could not be written (No space left"),
        (OSError(errno.EIO, "Input/output error"), "prog: the output could not be written (Input/output error)"),
        (ValueError("I/O operation on closed file"), ""),
    ],
)
def test_output_that_cannot_be_written_ends_nothing_and_is_told_once(
    error: Exception, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    output, errors = Broken(error), io.StringIO()
    monkeypatch.setattr(sys, "stdout", output)
    monkeypatch.setattr(sys, "stderr", errors)
    with steady_streams("prog"):
        for _ in range(3):
            printer(Console())("a line")
    assert errors.getvalue().startswith(told)
    assert errors.getvalue().count("\n") == bool(told)
    assert sys.stdout is output


def test_a_letter_that_the_stream_does_not_have_is_written_as_an_escape(monkeypatch: pytest.MonkeyPatch) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding="ascii"))
    with steady_streams("prog"):
        print("gr\u00fcn \udcff")
    assert raw.getvalue() == b"gr\\xfcn \\udcff\n"
