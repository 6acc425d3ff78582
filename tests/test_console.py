"""What the user reads: numbers in words."""

from __future__ import annotations

import errno
import io
import json
import subprocess
import sys

import numpy as np
import pytest
from rich.console import Console

from codesign_bench.console import (
    JsonLines,
    duration,
    json_lines,
    number,
    print_table,
    printer,
    steady_streams,
    tell,
    tell_left_out,
)


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


def test_for_programs_lines_tables_and_numbers_are_events() -> None:
    stream = io.StringIO()
    console = JsonLines(stream)
    printer(console)("a line \x1b]0;title\x07\n of two")
    print_table(console, ("cell", "steps"), [("push", "1,000"), ("scoop", "2,000")])
    assert tell(console, "numbers", some=[np.float64(0.5), np.int64(3), float("nan"), None], more={"a": True})
    assert not tell(Console(file=stream), "numbers")
    events = [json.loads(line) for line in stream.getvalue().splitlines()]
    assert [{name: value for name, value in event.items() if name != "time"} for event in events] == [
        {"event": "message", "text": "a line \x1b]0;title\x07\n of two"},
        {"event": "row", "cell": "push", "steps": "1,000"},
        {"event": "row", "cell": "scoop", "steps": "2,000"},
        {"event": "numbers", "some": [0.5, 3, None, None], "more": {"a": True}},
    ]
    assert all("\x1b" not in line for line in stream.getvalue().splitlines())


def test_what_libraries_print_is_not_among_the_events() -> None:
    line = (
        "import os; from codesign_bench.console import json_lines, printer\n"
        "with json_lines() as console:\n"
        "    os.write(1, b'of a library\\n'); print('of another'); printer(console)('ours')\n"
        "os.write(1, b'after\\n')"
    )
    done = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, check=True)
    first, last = done.stdout.splitlines()
    assert (json.loads(first)["text"], last) == ("ours", "after")
    assert set(done.stderr.splitlines()) == {"of a library", "of another"}


def test_events_go_where_standard_output_goes(capsys: pytest.CaptureFixture[str]) -> None:
    with json_lines() as console:
        printer(console)("ours")
    assert json.loads(capsys.readouterr().out)["text"] == "ours"


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
