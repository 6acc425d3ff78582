"""Everything that a page holds: tasks, their goals and scenes, and the cells with designers and recorded rollouts.

Shapes: `P` points, `X` axes, `F` features.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from codesign_bench.cell.variant import DEFAULT_NAME
from codesign_bench.console import Log
from codesign_bench.errors import UserError
from codesign_bench.registry import in_order
from codesign_bench.storage.cells import StoredCell, reported_cells
from codesign_bench.storage.policies import policy_of
from codesign_bench.task import Floats, Item, Singles, Sketch, Task, load_task
from codesign_bench.task.episodes import Episodes, portions
from codesign_bench.visible_text import on_one_line

from .designers import Designer, NetworkDesigner, OneDesign, designer_of, first_look, probes_of
from .functions import GoalFunction, fit
from .goals import Goals
from .packing import pack_frames, pack_program, pack_singles
from .rollouts import Structures, draws, record, stride_of, view_of
from .tools import ToolModel, tool_model, tool_values

GOALS = 64
"""Number of goals per cell on which rollouts are recorded, about."""
SMOOTH = 1e-4
"""Largest relative error of a polynomial for a scene at the start, which is only drawn."""


@dataclass(frozen=True)
class Choice:
    """The cells of a page."""

    tasks: tuple[str, ...] = ()
    """Names; empty: all, as for the others."""
    methods: tuple[str, ...] = ()
    seeds: tuple[int, ...] = ()
    goals: int = GOALS

    def includes(self, cell: StoredCell) -> bool:
        """Return whether a cell is of the default variant and among the chosen ones."""
        record = cell.record
        return (
            record.variant.name == DEFAULT_NAME
            and (not self.tasks or record.task in self.tasks)
            and (not self.methods or record.method in self.methods)
            and (not self.seeds or record.seed in self.seeds)
        )


def chosen_cells(results: Path, choice: Choice, log: Log) -> dict[str, list[StoredCell]]:
    """Return task -> its chosen cells with a policy that can be played, in the order of methods and seeds.

    Cells that cannot be shown are logged, a line for each reason.

    Raises:
        UserError: there is no folder, or no cell to show.
    """
    done = [cell for cell in reported_cells(results) if cell.is_done and choice.includes(cell)]
    if not done:
        raise UserError(
            f"no finished cell of this choice in '{results}'; see: codesign-bench status --results {results}"
        )
    without = [cell for cell in done if not cell.has_policy]
    if without:
        log(f"left out: {_counted(len(without))} without a policy in '{results}'")
    usable: list[StoredCell] = []
    reasons: dict[str, list[StoredCell]] = {}
    for cell in done:
        if cell.has_policy:
            try:
                policy_of(cell)
            except UserError as error:
                reasons.setdefault(_reason(str(error)), []).append(cell)
                continue
            usable.append(cell)
    for reason, cells in reasons.items():
        log(f"left out: {_counted(len(cells))} of {_tasks_of(cells)}: {reason}")
    if not usable:
        raise UserError(f"no cell of this choice in '{results}' has a policy that can be played")
    methods = in_order("methods", (cell.record.method for cell in usable))
    usable.sort(key=lambda cell: (methods.index(cell.record.method), cell.record.seed))
    return {
        task: [cell for cell in usable if cell.record.task == task]
        for task in in_order("tasks", (cell.record.task for cell in usable))
    }


def task_data(name: str, cells: Sequence[StoredCell], goal_count: int, log: Log) -> dict[str, Any]:
    """Return everything about one task, with its cells, as JSON values."""
    task = load_task(name)
    goals = Goals.of(task)
    points = goals.recorded(goal_count)
    observations = fit(lambda at: first_look(goals, at).astype(np.float64), goals)
    probes = probes_of(goals)
    seen = first_look(goals, probes)
    structures = Structures() if draws(task) else None
    model = tool_model(task)
    shown = [_cell_data(cell, goals, points, observations, (probes, seen), structures, model, log) for cell in cells]
    return {
        "name": name,
        "title": task.title,
        "axes": [
            {"name": axis.name, "unit": axis.unit, "low": axis.low, "high": axis.high, "values": list(axis.values)}
            for axis in goals.axes
        ],
        "places": [places.tolist() for places in goals.grid(goal_count)],
        "points": points.tolist(),
        "mask": _mask(goals),
        "observation": _function(observations),
        "design": {
            "names": list(task.design_space.names),
            "low": list(task.design_space.low),
            "high": list(task.design_space.high),
            "units": list(task.design_space.units),
        },
        "tool": None if model is None else _tool(model),
        "view": None if structures is None else view_of(_started(goals, points[:1])[0]),
        "colour": "#2c6fbb" if structures is None else _started(goals, points[:1])[0].tool_colour,
        "structures": [] if structures is None else structures.to_json(),
        "start": None if structures is None else _start(goals),
        "period": stride_of(task) * task.control_period,
        "stride": stride_of(task),
        "controlPeriod": task.control_period,
        "success": list(task.success_conditions.values()),
        "cells": shown,
    }


def _cell_data(
    cell: StoredCell,
    goals: Goals,
    points: Floats,
    observations: GoalFunction,
    probed: tuple[Floats, Singles],
    structures: Structures | None,
    model: ToolModel | None,
    log: Log,
) -> dict[str, Any]:
    policy, record_of = policy_of(cell), cell.record
    log(f"playing {record_of.task}, {record_of.method}, seed {record_of.seed}: {len(points)} goals")
    designer = designer_of(policy, goals, observations, *probed)
    recording = record(goals.task, policy, goals.instances(points), structures)
    return {
        "method": record_of.method,
        "label": on_one_line(record_of.label),
        "seed": record_of.seed,
        "steps": record_of.env_steps,
        "designer": _designer(designer),
        "success": recording.successes.astype(int).tolist(),
        "returns": np.round(recording.returns, 3).tolist(),
        "lengths": recording.lengths,
        "designs": pack_singles(recording.designs),
        "parts": None if model is not None else _parts(goals.task, recording.designs),
        "frames": None if structures is None else pack_frames(recording.frames, recording.structures),
    }


def _designer(designer: Designer) -> dict[str, Any]:
    if isinstance(designer, NetworkDesigner):
        content = {"kind": "network", **pack_program(designer.program, designer.bits)}
    elif isinstance(designer, OneDesign):
        content = {"kind": "one", "design": [float(value) for value in designer.design]}
    else:
        places = [axis.tolist() for axis in designer.places]
        content = {"kind": "grid", "places": places, "designs": pack_singles(designer.designs)}
    return {**content, "error": designer.error}


def _parts(task: Task, designs: Singles) -> dict[str, Any] | None:
    """Return the tools' parts at the recorded goals, of a task without a model of them; None if it defines none."""
    try:
        kind, values = tool_values(task, designs.astype(np.float64))
    except UserError:
        return None
    return {"kind": kind, "count": values.shape[1], "values": pack_singles(values)}


def _tool(model: ToolModel) -> dict[str, Any]:
    rows, columns = np.nonzero(model.weights)
    return {
        "kind": model.kind,
        "count": len(model.weights),
        "angles": model.angles.tolist(),
        "weights": [
            [int(row), int(column), float(np.round(model.weights[row, column], 12))]
            for row, column in zip(rows, columns, strict=True)
        ],
    }


def _function(function: GoalFunction) -> dict[str, Any]:
    combinations, terms, features = function.coefficients.shape
    return {
        "exponents": [list(exponent) for exponent in function.exponents],
        "shape": [combinations, terms, features],
        "coefficients": pack_singles(function.coefficients),
    }


def _mask(goals: Goals) -> dict[str, Any] | None:
    mask = goals.mask()
    if mask is None:
        return None
    return {"side": len(mask), "bits": base64.b64encode(np.packbits(mask).tobytes()).decode("ascii")}


def _started(goals: Goals, points: Floats) -> list[Sketch]:
    """Return the scenes right after a middling design, for goals that can be drawn."""
    instances, task = goals.instances(points), goals.task
    found = []
    for part in portions(len(instances), task):
        episodes, slots = Episodes(task, len(part)), np.arange(len(part))
        episodes.begin(slots, instances[part])
        episodes.design(slots, np.zeros((len(part), task.design_space.size)))
        found += [episodes.simulator.sketch(int(slot)) for slot in slots]
    return found


def _start(goals: Goals) -> dict[str, Any] | None:
    """Return the scene at the start as a function of the goal, or None if it is known at recorded goals only.

    Without an axis to move along smoothly, every goal is a recorded one. The tool's pose may depend on its design, and
    is left out.
    """
    if not goals.smooth:
        return None
    (first,) = _started(goals, goals.recorded(GOALS)[:1])
    skeleton = _skeleton(first)

    def numbers(points: Floats) -> Floats:
        sketches = _started(goals, points)
        if any(_skeleton(sketch) != skeleton for sketch in sketches):
            raise _ChangesShapeError
        return np.array([_numbers(sketch) for sketch in sketches])

    try:
        function = fit(numbers, goals)
    except _ChangesShapeError:
        return None
    # An item that jumps, such as the mark of a tool that starts clear of a body, is taken from the nearest recording.
    ends = np.cumsum([0, *(len(_numbers_of(item)) for item in first.items)])
    smooth = [bool((function.errors[a:b] < SMOOTH).all()) for a, b in pairwise(ends)]
    kept = [index for (a, b), known in zip(pairwise(ends), smooth, strict=True) if known for index in range(a, b)]
    items = [
        {
            "known": known,
            "pose": len(item.pose),
            "shapes": [
                [shape.kind, shape.colour, len(shape.points) * len(shape.points[0]), len(shape.size), shape.rotation]
                for shape in item.shapes
            ],
        }
        for item, known in zip(first.items, smooth, strict=True)
    ]
    return {**_function(function.part(kept)), "items": items}


class _ChangesShapeError(Exception):
    """Scenes of different goals do not have the same kinds of items."""


def _skeleton(sketch: Sketch) -> list[Any]:
    """Return what two scenes must share to be compared number by number."""
    return [
        (len(item.pose), [(shape.kind, shape.colour, len(shape.points), shape.rotation) for shape in item.shapes])
        for item in sketch.items
    ]


def _numbers(sketch: Sketch) -> list[float]:
    """Return all numbers of a scene without its tool: item by item the pose, then points and sizes of its shapes."""
    return [value for item in sketch.items for value in _numbers_of(item)]


def _numbers_of(item: Item) -> list[float]:
    shapes = [(*(value for point in shape.points for value in point), *shape.size) for shape in item.shapes]
    return [*item.pose, *(value for numbers in shapes for value in numbers)]


def _reason(message: str) -> str:
    """Return a message without the cell's own path, so that cells with the same reason are named once."""
    return message.split("' ", 1)[1] if message.startswith("'") else message


def _counted(count: int) -> str:
    return f"{count} cell{'s' * (count > 1)}"


def _tasks_of(cells: Sequence[StoredCell]) -> str:
    return ", ".join(in_order("tasks", (cell.record.task for cell in cells)))
