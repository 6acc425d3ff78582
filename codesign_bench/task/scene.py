"""The numbers that a scene is made of, with units and sources, spelled once where the scene's code uses them.

A module annotates its constants, and a docstring says what each of them is:

    PUCK_RADIUS: Annotated[float, Given("m", OURS)] = 1.0
    # its docstring follows

`constants(__name__)` collects them, for pages, tables and tests that set what runs beside what is printed elsewhere.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, get_args, get_origin, get_type_hints

OURS = "ours"
"""The source of what nothing published prescribes."""


@dataclass(frozen=True)
class Given:
    """Where a constant comes from; stands in its annotation."""

    unit: str
    """"1" for a number without one."""
    source: str
    """Of the value that runs: `OURS`, or what prints it, e.g. "paper, table of push"."""
    row: str = ""
    """The row of a published table that it stands for, whether or not it has the printed value; empty: no row."""


@dataclass(frozen=True)
class Constant:
    """A number, or several, of a scene."""

    value: Any
    unit: str
    source: str
    row: str


def constants(module_name: str) -> dict[str, Constant]:
    """Return name -> constant for the names in a module that are annotated with `Given` so far, in their order."""
    module = sys.modules[module_name]
    found = {}
    for name, hint in get_type_hints(module, include_extras=True).items():
        given = next((extra for extra in get_args(hint)[1:] if isinstance(extra, Given)), None)
        if get_origin(hint) is Annotated and given is not None:
            found[name] = Constant(getattr(module, name), given.unit, given.source, given.row)
    return found


def by_row(scene: Mapping[str, Constant]) -> dict[str, Constant]:
    """Return the constants that stand for a row of a published table, by the name of the row.

    Raises:
        ValueError: two stand for the same row.
    """
    rows: dict[str, Constant] = {}
    for name, constant in scene.items():
        if constant.row in rows:
            raise ValueError(f"{name} is not the only constant for the row '{constant.row}'")
        if constant.row:
            rows[constant.row] = constant
    return rows
