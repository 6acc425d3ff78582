"""Find methods by name."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from codesign_bench.console import Log, silent
from codesign_bench.method.method import Method
from codesign_bench.registry import load, names, usable


def method_names() -> tuple[str, ...]:
    """Return the names of all methods, built-in and third-party."""
    return names("methods")


def usable_methods(given: Iterable[str], log: Log = silent) -> list[str]:
    """Return those of the given methods that can be used in this Python; log the others, a line for each reason."""
    return usable(given, load_method, log)


def load_method(name: str) -> type[Method[Any]]:
    """Return the class of the method `name`.

    Raises:
        UserError: there is no such method.
        UnavailableError: it cannot be used in this Python.
    """
    method: type[Method[Any]] = load("methods", name, Method)
    return method
