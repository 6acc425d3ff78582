"""Kinds of values: what a setting or an option may be, declared once as its type; parsed from text, checked, described.

A kind is a type, which may say more of itself: `Annotated[int, Within(1, 4096)]`, `Annotated[tuple[Width, ...],
Length(1, 64)]`. Numbers are always finite, also where nothing more is said.
"""

from __future__ import annotations

import math
import re
import types
import typing
from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias

LONGEST_SHOWN = 80
"""Characters of a user's text that a message repeats."""
_DIGITS = re.compile(r"[+-]?[0-9]+(_[0-9]+)*")
_BOOLEANS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}


@dataclass(frozen=True)
class Within:
    """Numbers between two limits, which are finite and belong to them unless said otherwise."""

    low: float
    high: float
    open_low: bool = False
    """Whether `low` itself is excluded."""
    open_high: bool = False
    """Whether `high` itself is excluded."""

    def check(self, value: Any) -> None:
        """Check that a number is between the limits.

        Raises:
            ValueError: it is not, or is NaN.
        """
        above = value > self.low if self.open_low else value >= self.low
        below = value < self.high if self.open_high else value <= self.high
        if not (above and below):
            raise ValueError

    def __str__(self) -> str:
        low = f"above {_text(self.low)}" if self.open_low else f"from {_text(self.low)}"
        return f"{low} to below {_text(self.high)}" if self.open_high else f"{low} to {_text(self.high)}"


@dataclass(frozen=True)
class Length:
    """How many entries a tuple may have."""

    low: int
    high: int

    def check(self, value: Any) -> None:
        """Check that a tuple has as many entries.

        Raises:
            ValueError: it has fewer or more.
        """
        if not self.low <= len(value) <= self.high:
            raise ValueError

    def __str__(self) -> str:
        return f"{self.low} to {self.high} of them"


Share: TypeAlias = Annotated[float, Within(0.0, 1.0)]


def parse_value(kind: Any, text: str) -> Any:
    """Parse `text` as a value of a kind: int, float, bool, str, a literal, a tuple, or None, with limits if any.

    Raises:
        ValueError: it is not of this kind; the message says what was expected.
    """
    try:
        value = _parse(kind, text)
    except (ValueError, OverflowError):
        raise ValueError(described(kind)) from None
    check_value(kind, value)
    return value


def check_value(kind: Any, value: Any) -> None:
    """Check that a value is of a kind; numbers must be finite.

    Raises:
        ValueError: it is not; the message says what was expected.
    """
    try:
        _check(kind, value)
    except (ValueError, TypeError, OverflowError):
        raise ValueError(described(kind)) from None


def parse_int(text: str) -> int:
    """Parse an integer written as 150000, 150_000 or 1.5e5.

    Raises:
        ValueError: it is not an integer.
    """
    try:
        return int(_parse(int, text))
    except (ValueError, OverflowError):
        raise ValueError("an integer") from None


def described(kind: Any) -> str:
    """Return a kind in words, as in "expected an integer from 1 to 64"."""
    base, limits = _taken_apart(kind)
    origin, arguments = typing.get_origin(base), typing.get_args(base)
    told = " ".join(map(str, limits))
    if origin in (typing.Union, types.UnionType):
        return " or ".join(["none" if choice is type(None) else described(choice) for choice in arguments])
    if origin is typing.Literal:
        return f"one of {', '.join(map(str, arguments))}"
    if origin is tuple and arguments[1:] == (Ellipsis,):
        return ", ".join(filter(None, ["values separated by commas", told, f"each {described(arguments[0])}"]))
    if origin is tuple:
        return f"{len(arguments)} values separated by commas"
    return f"{_NAMES.get(base, f'a value of type {base}')} {told}".strip()


def printable(text: str) -> str:
    """Return a user's text as a message repeats it: without control characters, and not too long."""
    clean = "".join(letter if letter.isprintable() else "?" for letter in text)
    half = LONGEST_SHOWN // 2
    return clean if len(clean) <= LONGEST_SHOWN else f"{clean[:half]}...{clean[-half:]}"


def shown(text: str) -> str:
    """Return a user's text in quotation marks as a message repeats it."""
    return f"'{printable(text)}'"


_NAMES = {int: "an integer", float: "a number", bool: "true or false", str: "a text"}


def _taken_apart(kind: Any) -> tuple[Any, tuple[Any, ...]]:
    """Return a kind without what it says of itself, and that."""
    if typing.get_origin(kind) is typing.Annotated:
        base, *limits = typing.get_args(kind)
        return base, tuple(limit for limit in limits if isinstance(limit, Within | Length))
    return kind, ()


def plain_type(kind: Any) -> Any:
    """Return the type of a kind without its limits."""
    return _taken_apart(kind)[0]


def _parse(kind: Any, text: str) -> Any:
    base, _ = _taken_apart(kind)
    origin, arguments = typing.get_origin(base), typing.get_args(base)
    if origin in (typing.Union, types.UnionType):
        return _parse_union(arguments, text)
    if origin is typing.Literal:
        return next(iter([choice for choice in arguments if str(choice) == text]), text)
    if origin is tuple:
        return _parse_tuple(arguments, text)
    if base is str:
        return text
    if not text.isascii() or base not in _NAMES:  # Python reads the digits of every script
        raise ValueError
    if base is bool:
        return _BOOLEANS.get(text.lower(), text)
    if base is int and _DIGITS.fullmatch(text.strip()):
        return int(text)
    number = float(text)
    return number if base is float else _as_integer(number)


def _as_integer(number: float) -> int:
    if number != int(number):
        raise ValueError
    return int(number)


def _parse_union(choices: tuple[Any, ...], text: str) -> Any:
    if type(None) in choices and text.lower() in ("none", "null"):
        return None
    for choice in choices:
        if choice is not type(None):
            try:
                return parse_value(choice, text)
            except ValueError:
                continue
    raise ValueError


def _parse_tuple(arguments: tuple[Any, ...], text: str) -> tuple[Any, ...]:
    items = [item.strip() for item in text.strip("()[] ").split(",") if item.strip()]
    kinds = (arguments[0],) * len(items) if arguments[1:] == (Ellipsis,) else arguments
    return tuple(_parse(kind, item) for kind, item in zip(kinds, items, strict=True))


def _check(kind: Any, value: Any) -> None:
    base, limits = _taken_apart(kind)
    origin, arguments = typing.get_origin(base), typing.get_args(base)
    if origin in (typing.Union, types.UnionType):
        _check_union(arguments, value)
    elif origin is typing.Literal:
        _require(value in arguments)
    elif origin is tuple:
        entries = tuple(value)
        kinds = (arguments[0],) * len(entries) if arguments[1:] == (Ellipsis,) else arguments
        for entry_kind, entry in zip(kinds, entries, strict=True):
            _check(entry_kind, entry)
    elif base is bool or base is str:
        _require(isinstance(value, base))
    elif base in (int, float):
        _require(not isinstance(value, bool | str) and math.isfinite(value) and (base is float or value == int(value)))
    for limit in limits:
        limit.check(value)


def _check_union(choices: tuple[Any, ...], value: Any) -> None:
    if value is None and type(None) in choices:
        return
    for choice in choices:
        try:
            return check_value(choice, value) if choice is not type(None) else _require(False)
        except ValueError:
            continue
    raise ValueError


def _require(holds: bool) -> None:
    if not holds:
        raise ValueError


def _text(number: float) -> str:
    """Return a limit: an integer with separators, or the shortest form of a number."""
    return f"{number:,}" if isinstance(number, int) else f"{number:g}"
