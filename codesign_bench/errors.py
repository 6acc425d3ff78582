"""Errors that the user can fix; any other exception keeps its traceback."""

from __future__ import annotations

from collections.abc import Iterable


class UserError(Exception):
    """Bad input; the command line reports it in one or two lines (exit code 2)."""


class OtherObservationError(UserError):
    """What is stored was trained with another observation than its task gives now, so it cannot go on or act."""


def unknown_name(kind: str, name: str, choices: Iterable[str]) -> UserError:
    """Return the error for a name that is not among `choices`; its message lists them."""
    return UserError(f"unknown {kind} '{name}'; choose from: {', '.join(choices)}")
