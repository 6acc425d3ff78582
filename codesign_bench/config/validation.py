"""Checks of configurations: a value that its field's declared kind does not allow is reported before anything runs."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import fields
from types import SimpleNamespace
from typing import Any, get_type_hints

from codesign_bench.config.values import check_value

_stored: ContextVar[bool] = ContextVar("stored", default=False)


def kinds_of(config_class: type, limits: bool = True) -> dict[str, Any]:
    """Return the declared kind of every field of a configuration, with or without its limits."""
    names, hints = {field.name for field in fields(config_class)}, dict[str, Any]()
    for owner in reversed(config_class.__mro__):
        declared = {name: kind for name, kind in inspect.get_annotations(owner).items() if name in names}
        # Without class variables, among which Python 3.10 refuses a plain `ClassVar`.
        of_fields = SimpleNamespace(__annotations__=declared)
        hints |= get_type_hints(of_fields, vars(sys.modules[owner.__module__]), include_extras=limits)
    return hints


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
