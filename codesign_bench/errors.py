"""Errors that the user can fix; any other exception keeps its traceback."""

from __future__ import annotations

from collections.abc import Iterable


class UserError(Exception):
    """Bad input; the command line reports it in one or two lines (exit code 2)."""


class UnavailableError(UserError):
    """A task, method, figure or study cannot be used in this Python: it cannot be imported, or a package is missing."""

    def __init__(self, reason: str, member: str = "") -> None:
        super().__init__(f"{member} is not available: {reason}" if member else reason)
        self.reason = reason


class ChangedTaskError(UserError):
    """The task has changed since a stored state was trained, so the state can neither be resumed nor act."""


def unknown_name(kind: str, name: str, choices: Iterable[str]) -> UserError:
    """Return the error for a name that is not among `choices`; its message lists them."""
    return UserError(f"unknown {kind} '{name}'; choose from: {', '.join(choices)}")
