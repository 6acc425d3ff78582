"""Checks of configurations: a value that its field's declared kind does not allow is reported before anything runs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import fields
from typing import Any, get_type_hints

from codesign_bench.config.values import check_value

_stored: ContextVar[bool] = ContextVar("stored", default=False)


def kinds_of(config_class: type) -> dict[str, Any]:
    """Return the declared kind of every field of a configuration, with its limits."""
    hints = get_type_hints(config_class, include_extras=True)
    return {field.name: hints[field.name] for field in fields(config_class)}


def check_values(config: Any) -> None:
    """Check that every value of a configuration is of its field's declared kind; numbers must be finite.

    Raises:
        ValueError: one is not; names the first.
    """
    if _stored.get():
        return
    for name, kind in kinds_of(type(config)).items():
        try:
            check_value(kind, getattr(config, name))
        except ValueError as error:
            raise ValueError(f"{name} must be {error}, not {getattr(config, name)!r}") from None


@contextmanager
def stored_values() -> Iterator[None]:
    """Allow values that are out of today's limits: results of an earlier version remain readable."""
    token = _stored.set(True)
    try:
        yield
    finally:
        _stored.reset(token)
