"""Variants of cells: values on named axes. Only this module derives a folder's name from a variant."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias

DEFAULT_NAME = "default"
"""Name of the default variant, without varied axes."""
FIRST_AXES = ("cutout", "alpha", "finetune", "scratch")
"""Axes that come first in names and tables, in this order; others follow by name."""

Value: TypeAlias = float | int | str


@dataclass(frozen=True)
class Variant:
    """Values on axes, e.g. `Variant.of(cutout=0.4)`; `Variant()` is the default variant."""

    values: tuple[tuple[str, Value], ...] = ()
    """Axis and value, in the order of axes; made by `of`."""

    @classmethod
    def of(cls, **values: Value | None) -> Variant:
        """Return the variant with these values; None means that an axis is not varied."""
        given = {axis: value for axis, value in values.items() if value is not None}
        return cls(tuple((axis, given[axis]) for axis in in_axis_order(given)))

    @property
    def name(self) -> str:
        """Its name, e.g. `default`, `cutout-0.40`, `cutout-0.40_alpha-0.30`, `finetune-1`."""
        return "_".join(f"{axis}-{_text(value)}" for axis, value in self.values) or DEFAULT_NAME

    def get(self, axis: str) -> Value | None:
        """Return the value on an axis, or None if it is not varied."""
        return dict(self.values).get(axis)

    def without(self, axis: str) -> Variant:
        """Return the same variant without this axis."""
        return Variant(tuple((name, value) for name, value in self.values if name != axis))

    def with_(self, **values: Value | None) -> Variant:
        """Return the same variant with other values on these axes."""
        return Variant.of(**{**self.to_json(), **values})

    def __iter__(self) -> Iterator[tuple[str, Value]]:
        """Yield each varied axis and its value."""
        return iter(self.values)

    def to_json(self) -> dict[str, Value]:
        """Return axis -> value."""
        return dict(self.values)

    @classmethod
    def from_json(cls, values: Mapping[str, Value | None]) -> Variant:
        """Return the variant that `to_json` wrote.

        Raises:
            TypeError: a value is neither a number nor text.
        """
        for axis, value in values.items():
            if value is not None and (isinstance(value, bool) or not isinstance(value, float | int | str)):
                raise TypeError(f"the value of axis '{axis}' is a {type(value).__name__}")
        return cls.of(**values)


DEFAULT = Variant()
"""The default variant, without varied axes."""


def in_axis_order(axes: Mapping[str, object] | set[str]) -> list[str]:
    """Return the names of axes in the order of variants' names and tables."""
    return [axis for axis in FIRST_AXES if axis in axes] + sorted(set(axes) - set(FIRST_AXES))


def _text(value: Value) -> str:
    """Return a value as text; floats have two decimals if these are exact, otherwise all digits."""
    if isinstance(value, float):
        return f"{value:.2f}" if round(value, 2) == value else repr(value)
    return str(value)
