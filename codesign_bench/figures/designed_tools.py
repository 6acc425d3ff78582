"""Pictures of designed tools, recorded by finished cells, for goals spread over the goal space.

Shapes: `N` evaluation instances, `G` goal, `I` instance.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from codesign_bench.errors import UserError
from codesign_bench.evaluation.rendering import render_slot
from codesign_bench.figures.source import Request
from codesign_bench.registry import names
from codesign_bench.storage.frames import default_rows, load_evaluations, rows_varying
from codesign_bench.task import Box, Floats, Frame, Task, load_task
from codesign_bench.task.behaviours import GivenDesigns, Idle
from codesign_bench.task.episodes import Episodes
from codesign_bench.task.play import designed
from codesign_bench.task.sketch import Sketch

if TYPE_CHECKING:
    import pandas as pd

TOOL_COLOUR = Sketch.tool_colour
"""Colour of tools in pictures, unless a task chooses another."""
MAP_SIDE = 3
"""A map: the ranges of two entries are divided into this many intervals each, with one picture per field."""
LINE_LENGTH = 8
"""A line: largest number of pictures over one entry, all in one row."""


@dataclass(frozen=True)
class Place:
    """An evaluation instance and its position in a grid; row 0 is the top."""

    instance: int
    row: int
    column: int


def designed_tools(request: Request) -> pd.DataFrame:
    """Return pictures of the tools of one designer per task and variant, right after the design step.

    Variants are `default` and those of the trade-off. The designer is the first method in the order of methods that
    has a finished cell there, with its lowest seed, so that results play no part in the choice.

    Returns:
        The columns of `load_evaluations`, one row per picture, with `title` (the task's), `row` and `column` (place in
        the task's grid), `across` and `up` (what changes along columns and, from below, along rows; `up` is empty if
        goals have one entry), `goal` (that goal in words) and `picture` (height, width, 3).

    Raises:
        UserError: no finished cell can be drawn.
    """
    import pandas as pd

    evaluations = load_evaluations(request.results)
    frame = pd.concat([default_rows(evaluations), rows_varying(evaluations, "alpha")])
    parts = []
    for (name, _), rows in frame.groupby(["task", "variant"], sort=False):
        try:
            parts.append(_pictures(load_task(str(name)), _one_cell(rows)))
        except UserError as error:
            request.log(f"tools for {name} left out: {error}")
    if not parts:
        raise UserError(f"no finished cell in '{request.results}' whose tools can be drawn")
    return pd.concat(parts, ignore_index=True)


def spread(goals: Floats) -> list[Place]:
    """Choose instances that cover the goals (N, 1 or 2): at most one per field of a grid, nearest to its centre.

    Goals with one entry form a line from low to high, with one instance per value if there are few values. Goals with
    two entries form a map, the second entry upwards. Fields without goals are empty on a map and skipped on a line.
    """
    goals = np.asarray(goals, dtype=np.float64)
    if goals.shape[1] == 1:
        chosen = _along_a_line(goals[:, 0])
        return [Place(instance, 0, position) for position, instance in enumerate(chosen)]
    (column, x), (row, y) = (_stretches(goals[:, entry], MAP_SIDE) for entry in (0, 1))
    result = []
    for field_x, field_y in product(range(MAP_SIDE), repeat=2):
        members = np.flatnonzero((column == field_x) & (row == field_y))
        if members.size:
            nearest = members[np.maximum(x[members], y[members]).argmin()]
            result.append(Place(int(nearest), MAP_SIDE - 1 - field_y, field_x))
    return sorted(result, key=lambda place: (place.row, place.column))


def _along_a_line(values: Floats) -> list[int]:
    distinct = np.unique(values)
    if len(distinct) <= LINE_LENGTH:
        return [int(np.flatnonzero(values == value)[0]) for value in distinct]
    stretch, off_middle = _stretches(values, LINE_LENGTH)
    members = [np.flatnonzero(stretch == position) for position in range(LINE_LENGTH)]
    return [int(own[off_middle[own].argmin()]) for own in members if own.size]


def _stretches(values: Floats, count: int) -> tuple[NDArray[np.int_], Floats]:
    """Return which of `count` intervals of their range the values (N,) are in, and their distances from its middle."""
    low, high = values.min(), values.max()
    place = count * (values - low) / max(high - low, 1e-12)
    stretch = np.minimum(place.astype(np.int_), count - 1)
    return stretch, np.abs(place - stretch - 0.5)


def _one_cell(rows: pd.DataFrame) -> pd.DataFrame:
    present = set(rows["method"])
    method = next((name for name in names("methods") if name in present), min(present))
    own = rows[rows["method"] == method]
    return own[own["seed"] == own["seed"].min()]


def _pictures(task: Task, cell: pd.DataFrame) -> pd.DataFrame:
    import pandas as pd

    instances = _entries(cell, "instance", task.instance_space)
    designs = _entries(cell, "design", task.design_space)
    goals, space = instances[:, : task.goal_size], task.goal_space
    shown = _shown(task)
    places = spread(instances[:, [task.instance_space.index(name) for name in shown]])
    chosen = [place.instance for place in places]
    return (
        cell.iloc[chosen]
        .assign(
            title=task.title,
            row=[place.row for place in places],
            column=[place.column for place in places],
            across=_words(shown[0]),
            up=_words(shown[1]) if len(shown) > 1 else "",
            goal=[_describe(space, goal) for goal in goals[chosen]],
        )
        .assign(picture=pd.Series(_draw(task, instances[chosen], designs[chosen]), index=cell.index[chosen]))
    )


def _shown(task: Task) -> tuple[str, ...]:
    """Return the one or two entries of an instance for the grid: those of its position, or else of its goal."""
    return task.position_entries or task.goal_space.names[:2]


def _entries(cell: pd.DataFrame, kind: str, space: Box) -> Floats:
    """Return the columns of a space's entries as (N, size).

    Raises:
        UserError: the cell is from another version of the task.
    """
    columns = [f"{kind}_{name}" for name in space.names]
    missing = [column for column in columns if column not in cell.columns]
    if missing:
        raise UserError(f"its evaluation lacks {', '.join(missing)}; it may be from another version of the task")
    values: Floats = cell[columns].to_numpy(dtype=np.float64)
    return values


def _draw(task: Task, instances: Floats, designs: Floats) -> list[Frame]:
    """Return a picture of each instance (N, I) with its tool."""
    frames, episodes, idle = [], Episodes(task, 1), Idle(task)
    for instance, unit_design in zip(instances, task.design_space.to_unit(designs), strict=True):
        designed(episodes, GivenDesigns(unit_design[None], idle), instance[None])
        frames.append(render_slot(episodes, 0))
    return frames


def _describe(space: Box, goal: Floats) -> str:
    """Return a goal in words, e.g. "goal x: 14.2 m, goal y: 4.04 m"."""
    units = [
        "" if unit == "1" or unit in name else f" {unit}" for name, unit in zip(space.names, space.units, strict=True)
    ]
    entries = zip(space.names, goal, units, strict=True)
    return ", ".join(f"{_words(name)}: {value:.3g}{unit}" for name, value, unit in entries)


def _words(name: str) -> str:
    return name.replace("_", " ")
