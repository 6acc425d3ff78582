"""The constants of a scene, with units and sources, defined once where the scene's code uses them.

A module annotates its constants, and a docstring describes each of them:

    PUCK_RADIUS: Annotated[float, Given("m", OURS)] = 1.0
    # its docstring follows

`constants(__name__)` collects them for documentation, tables and tests that compare them with published values.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, get_args, get_origin, get_type_hints

OURS = "ours"
"""The source of a value that no publication gives."""


@dataclass(frozen=True)
class Given:
    """Unit and source of a constant; part of its annotation."""

    unit: str
    """"1" for a number without a unit."""
    source: str
    """Source of the value in use: `OURS`, or the publication, e.g. "paper, table of push"."""
    row: str = ""
    """The row of a published table that the constant implements, with the printed value or another; empty: no row."""


@dataclass(frozen=True)
class Constant:
    """One or several numbers of a scene."""

    value: Any
    unit: str
    source: str
    row: str


def constants(module_name: str) -> dict[str, Constant]:
    """Return name -> constant for all names of a module annotated with `Given` so far, in order of definition."""
    module = sys.modules[module_name]
    found = {}
    for name, hint in get_type_hints(module, include_extras=True).items():
        given = next((extra for extra in get_args(hint)[1:] if isinstance(extra, Given)), None)
        if get_origin(hint) is Annotated and given is not None:
            found[name] = Constant(getattr(module, name), given.unit, given.source, given.row)
    return found


def by_row(scene: Mapping[str, Constant]) -> dict[str, Constant]:
    """Return the constants that implement a row of a published table, by the name of the row.

    Raises:
        ValueError: two constants have the same row.
    """
    rows: dict[str, Constant] = {}
    for name, constant in scene.items():
        if constant.row in rows:
            raise ValueError(f"{name} is the second constant for the row '{constant.row}'")
        if constant.row:
            rows[constant.row] = constant
    return rows
