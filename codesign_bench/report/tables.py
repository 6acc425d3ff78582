"""Tables of the page: only text; the template does the layout."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

NOTHING = "\N{EN DASH}"
"""Shown instead of a missing value."""


@dataclass(frozen=True)
class Table:
    """Header and rows of text; the columns named in `numeric` are aligned to the right."""

    header: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    numeric: frozenset[str] = field(default_factory=frozenset)


def number(value: float) -> str:
    """Return a number with two decimals and a minus sign, or a dash for NaN."""
    return NOTHING if value != value else f"{value:.2f}".replace("-", "\N{MINUS SIGN}")


def listed(values: list[str], most: int = 4) -> str:
    """Return up to `most` values separated by commas, and how many more there are."""
    more = f" and {len(values) - most} more" if len(values) > most else ""
    return ", ".join(values[:most]) + more
