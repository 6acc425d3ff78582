"""What the user reads: numbers in words."""

from __future__ import annotations

import errno
import io
import sys

import pytest
from rich.console import Console

from codesign_bench.console import duration, number, print_table, printer, steady_streams, tell_left_out


def test_durations_have_the_largest_unit_that_fits() -> None:
    assert [duration(seconds) for seconds in (42, 600, 12_600)] == ["42 s", "10 min", "3.5 h"]


def test_numbers_have_two_decimals_and_nothing_stands_for_none() -> None:
    assert [number(1.234), number(None)] == ["1.23", ""]


@pytest.mark.parametrize("terminal", [True, False])
def test_text_of_results_controls_no_terminal(terminal: bool) -> None:
    stream = io.StringIO()
    console = Console(file=stream, force_terminal=terminal, no_color=True, width=200)
    printer(console)("a line \x1b]0;title\x07")
    print_table(console, ("[bold]cell",), [("\x1b[2J\rgone\nand [red]more",)])
    for shown in (r"a line \x1b]0;title\x07", r"\x1b[2J\rgone and [red]more", "[bold]cell"):
        assert shown in stream.getvalue()
    assert "\x07" not in stream.getvalue()
    assert "\x1b[2J" not in stream.getvalue()


def test_what_is_left_out_is_told_on_standard_error(capsys: pytest.CaptureFixture[str]) -> None:
    tell_left_out(["a.csv: empty", "b.csv: \x1b"])
    assert capsys.readouterr() == ("", "left out: a.csv: empty\nleft out: b.csv: \\x1b\n")


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
