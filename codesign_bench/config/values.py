"""Parse values of settings from text, for `--set` and other options."""

from __future__ import annotations

import types
import typing
from typing import Any


def parse_value(annotation: Any, text: str) -> Any:
    """Parse `text` as the type `annotation`: int, float, bool, str, a literal, a tuple, or None.

    Raises:
        ValueError: it is not of this type; the message says what was expected.
    """
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if origin in (typing.Union, types.UnionType):
        return _parse_union(arguments, text)
    if origin is typing.Literal:
        matches = [choice for choice in arguments if str(choice) == text]
        if not matches:
            raise ValueError(f"one of {', '.join(map(str, arguments))}")
        return matches[0]
    if origin is tuple:
        return _parse_tuple(arguments, text)
    if annotation is bool:
        return _parse_bool(text)
    if annotation is int:
        return parse_int(text)
    if annotation is float:
        try:
            return float(text)
        except ValueError:
            raise ValueError("a number") from None
    if annotation is str:
        return text
    raise ValueError(f"nothing: values of type {annotation} cannot be set from the command line")


def parse_int(text: str) -> int:
    """Parse an integer written as 150000, 150_000 or 1.5e5.

    Raises:
        ValueError: it is not an integer.
    """
    try:
        number = float(text)
        if number == int(number):
            return int(text) if text.lstrip("+-").replace("_", "").isdigit() else int(number)
    except (ValueError, OverflowError):
        pass
    raise ValueError("an integer")


def _parse_union(choices: tuple[Any, ...], text: str) -> Any:
    if type(None) in choices and text.lower() in ("none", "null"):
        return None
    expected = []
    for choice in choices:
        if choice is not type(None):
            try:
                return parse_value(choice, text)
            except ValueError as error:
                expected.append(str(error))
    raise ValueError(" or ".join(expected + ["none"] * (type(None) in choices)))


def _parse_tuple(arguments: tuple[Any, ...], text: str) -> tuple[Any, ...]:
    items = [item.strip() for item in text.strip("()[] ").split(",") if item.strip()]
    if len(arguments) == 2 and arguments[1] is Ellipsis:
        arguments = (arguments[0],) * len(items)
    if len(items) != len(arguments):
        raise ValueError(f"{len(arguments)} values separated by commas")
    try:
        return tuple(parse_value(kind, item) for kind, item in zip(arguments, items, strict=True))
    except ValueError as error:
        raise ValueError(f"values separated by commas, each {error}") from None


def _parse_bool(text: str) -> bool:
    meanings = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}
    if text.lower() not in meanings:
        raise ValueError("true or false")
    return meanings[text.lower()]
