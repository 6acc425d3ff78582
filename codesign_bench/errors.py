"""Errors that a user causes and can mend; everything else keeps its traceback."""

from __future__ import annotations

from collections.abc import Iterable


class UserError(Exception):
    """Bad input, told in one or two lines by the command line (exit code 2)."""


def unknown_name(kind: str, name: str, choices: Iterable[str]) -> UserError:
    """Return the error for a name that is not among `choices`, listing them."""
    return UserError(f"unknown {kind} '{name}'; choose from: {', '.join(choices)}")
