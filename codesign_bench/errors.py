"""Errors that the user can fix; any other exception keeps its traceback."""

from __future__ import annotations

import traceback
from collections.abc import Iterable
from pathlib import Path

from codesign_bench.visible_text import on_one_line


class UserError(Exception):
    """Bad input; the command line reports it in one or two lines (exit code 2)."""


class UnavailableError(UserError):
    """A task, method, figure or study cannot be used in this Python: it cannot be imported, or a package is missing."""

    def __init__(self, reason: str, member: str = "") -> None:
        super().__init__(f"{member} is not available: {reason}" if member else reason)
        self.reason = reason


class ChangedTaskError(UserError):
    """The task has changed since a stored state was trained, so the state can neither be resumed nor act."""


class UnknownNameError(UserError):
    """No member has this name."""


def unknown_name(kind: str, name: str, choices: Iterable[str]) -> UnknownNameError:
    """Return the error for a name that is not among `choices`; its message lists them."""
    return UnknownNameError(f"unknown {kind} '{on_one_line(name)}'; choose from: {', '.join(choices)}")


def in_one_line(error: BaseException) -> str:
    """Return an error of code that is not ours as one line: its type, its message, and the file and line it is from."""
    text = " ".join(traceback.format_exception_only(error)[-1].split())
    frames = traceback.extract_tb(error.__traceback__)
    place = (error.filename, error.lineno) if isinstance(error, SyntaxError) else (None, None)
    file, line = place if place[0] or not frames else (frames[-1].filename, frames[-1].lineno)
    return f"{text} ({Path(file).name}, line {line})" if file else text
