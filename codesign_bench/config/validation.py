"""Checks of hyperparameters: invalid values are reported before anything runs."""

from __future__ import annotations

from typing import Any, Literal, get_args, get_origin, get_type_hints


def check_range(config: Any, low: float, high: float, *names: str) -> None:
    """Check that the fields `names` of a configuration, numbers or tuples of numbers, are in [low, high].

    Raises:
        ValueError: one is not; names the first.
    """
    for name in names:
        value = getattr(config, name)
        for number in value if isinstance(value, tuple) else (value,):
            if number is not None and not low <= number <= high:
                limit = f"at least {low:g}" if high == float("inf") else f"from {low:g} to {high:g}"
                raise ValueError(f"{name} must be {limit}, not {value}")


def check_given(config: Any, *names: str) -> None:
    """Check that the tuples `names` of a configuration are not empty.

    Raises:
        ValueError: one is empty; names the first.
    """
    for name in names:
        if not getattr(config, name):
            raise ValueError(f"{name} must have at least one entry")


def check_choices(config: Any) -> None:
    """Check that every literal field of a configuration has one of its choices.

    Raises:
        ValueError: one does not; names the first and its choices.
    """
    for name, hint in get_type_hints(type(config)).items():
        if get_origin(hint) is Literal and getattr(config, name) not in get_args(hint):
            choices = ", ".join(f"'{choice}'" for choice in get_args(hint))
            raise ValueError(f"{name} must be one of {choices}, not '{getattr(config, name)}'")
