"""Entries of a JSON object, each with the type that it must have; errors name the entry."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

Value = TypeVar("Value")

MOST_CHARACTERS = 500
"""Of a name or a label; errors and tracebacks may be longer."""
LARGEST_WHOLE = 2**53
"""Beyond this, tables could not hold every integer."""


def text(content: Mapping[str, Any], name: str, most: int | None = MOST_CHARACTERS) -> str:
    """Return a text entry of at most `most` characters.

    Raises:
        KeyError, ValueError: it is absent or something else.
    """
    value = content[name]
    if not isinstance(value, str):
        raise ValueError(f"'{name}' is not text")
    if most is not None and len(value) > most:
        raise ValueError(f"'{name}' has {len(value)} characters")
    if any("\ud800" <= character <= "\udfff" for character in value):
        raise ValueError(f"'{name}' has half a character")
    return value


def whole(content: Mapping[str, Any], name: str) -> int:
    """Return an integer from 0.

    Raises:
        KeyError, ValueError: it is absent or something else.
    """
    value = content[name]
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= LARGEST_WHOLE:
        raise ValueError(f"'{name}' is not an integer from 0 to {LARGEST_WHOLE}")
    return value


def number(content: Mapping[str, Any], name: str) -> float:
    """Return a finite number.

    Raises:
        KeyError, ValueError: it is absent or something else.
    """
    value = content[name]
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"'{name}' is not a finite number")
    return value


def entries(content: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Return an object.

    Raises:
        KeyError, ValueError: it is absent or something else.
    """
    value = content[name]
    if not isinstance(value, dict):
        raise ValueError(f"'{name}' is not an object")
    return value


def optional(read: Callable[[Mapping[str, Any], str], Value], content: Mapping[str, Any], name: str) -> Value | None:
    """Return what `read` returns, or None if the entry is absent or null."""
    return None if content.get(name) is None else read(content, name)
