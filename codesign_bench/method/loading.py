"""Find methods by name."""

from __future__ import annotations

from typing import Any

from codesign_bench.method.method import Method
from codesign_bench.registry import load, names


def method_names() -> tuple[str, ...]:
    """Return the names of all methods, built-in and third-party."""
    return names("methods")


def load_method(name: str) -> type[Method[Any]]:
    """Return the class of the method `name`.

    Raises:
        UserError: there is no such method.
    """
    method: type[Method[Any]] = load("methods", name, Method)
    return method
