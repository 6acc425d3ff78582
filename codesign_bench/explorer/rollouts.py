"""Episodes of a policy on a grid of goals, recorded as poses of bodies.

Shapes: `P` points, `T` frames, `N` numbers of a frame, `D` design.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from codesign_bench.method import Policy
from codesign_bench.task import Booleans, Floats, Item, Singles, Sketch, Task, Viewpoint, Window
from codesign_bench.task.episodes import Episodes, portions
from codesign_bench.task.play import play

FRAMES_PER_SECOND = 12.0
"""Largest number of frames per second of simulated time."""
DIGITS = 5
"""Digits behind the point of sizes and places of shapes, m."""


@dataclass
class Structures:
    """The different sets of items of a task's scenes; frames name theirs by its number."""

    known: dict[tuple[Any, ...], int] = field(default_factory=dict)

    def number(self, sketch: Sketch) -> int:
        """Return the number of a sketch's structure: everything but its poses."""
        items = tuple((len(item.pose), tuple(_rounded(item))) for item in sketch.items)
        return self.known.setdefault((items, len(sketch.tool_pose)), len(self.known))

    def to_json(self) -> list[dict[str, Any]]:
        """Return the structures in the order of their numbers."""
        return [
            {
                "items": [{"pose": pose, "shapes": [list(shape) for shape in shapes]} for pose, shapes in items],
                "tool": tool,
            }
            for items, tool in self.known
        ]


@dataclass(frozen=True)
class Recording:
    """One episode on each of the points."""

    designs: Singles
    """(P, D) in [-1, 1]."""
    successes: Booleans
    """(P,)"""
    returns: Floats
    """(P,)"""
    lengths: list[int]
    """(P,) control steps."""
    frames: list[list[list[float]]]
    """(P,) the poses of all items and of the tool, one behind the other, of every frame."""
    structures: list[list[int]]
    """(P,) the number of each frame's structure."""


def stride_of(task: Task) -> int:
    """Return the number of control steps between frames."""
    return max(1, round(1.0 / (FRAMES_PER_SECOND * task.control_period)))


def draws(task: Task) -> bool:
    """Return whether a task gives its scenes as data."""
    episodes = Episodes(task, 1)
    episodes.begin(np.arange(1), task.evaluation_instances()[:1])
    episodes.design(np.arange(1), np.zeros((1, task.design_space.size)))
    try:
        episodes.simulator.sketch(0)
    except NotImplementedError:
        return False
    return True


def record(task: Task, policy: Policy, instances: Floats, structures: Structures | None) -> Recording:
    """Play one episode of `policy` on each of `instances` (P, I); without `structures`, no frames are kept."""
    parts = [_record(task, policy, instances[part], structures) for part in portions(len(instances), task)]
    return Recording(
        designs=np.concatenate([part.designs for part in parts]),
        successes=np.concatenate([part.successes for part in parts]),
        returns=np.concatenate([part.returns for part in parts]),
        lengths=[length for part in parts for length in part.lengths],
        frames=[frames for part in parts for frames in part.frames],
        structures=[numbers for part in parts for numbers in part.structures],
    )


def _record(task: Task, policy: Policy, instances: Floats, structures: Structures | None) -> Recording:
    count, stride = len(instances), stride_of(task)
    episodes = Episodes(task, count)
    returns, lengths = np.zeros(count), [0] * count
    frames: list[list[list[float]]] = [[] for _ in range(count)]
    numbers: list[list[int]] = [[] for _ in range(count)]
    for turn in play(episodes, policy, instances):
        returns[turn.slots] += turn.reward
        for slot, over in zip(turn.slots.tolist(), turn.over.tolist(), strict=True):
            lengths[slot] = turn.step
            if structures is not None and (over or turn.step % stride == 0):
                sketch = episodes.simulator.sketch(slot)
                numbers[slot].append(structures.number(sketch))
                frames[slot].append(poses(sketch))
    return Recording(
        designs=episodes.observation[:count, episodes.layout.design].copy(),
        successes=episodes.success(np.arange(count)).copy(),
        returns=returns,
        lengths=lengths,
        frames=frames,
        structures=numbers,
    )


def poses(sketch: Sketch) -> list[float]:
    """Return the poses of a sketch's items and of its tool, one behind the other."""
    return [value for pose in (*(item.pose for item in sketch.items), sketch.tool_pose) for value in pose]


def view_of(sketch: Sketch) -> dict[str, Any]:
    """Return how a sketch is seen, as JSON values."""
    view = sketch.view
    if isinstance(view, Window):
        return {"x": list(view.x), "y": list(view.y)}
    assert isinstance(view, Viewpoint)
    return {
        "eye": list(view.eye),
        "target": list(view.target),
        "up": list(view.up),
        "field": view.field_of_view,
        "near": view.near,
        "aspect": view.aspect,
    }


def _rounded(item: Item) -> list[tuple[Any, ...]]:
    """Return the shapes of an item as tuples of JSON values."""
    return [
        (
            shape.kind,
            shape.colour,
            tuple(round(float(value), DIGITS) for point in shape.points for value in point),
            tuple(round(float(value), DIGITS) for value in shape.size),
            tuple(round(float(value), DIGITS) for value in shape.rotation),
        )
        for shape in item.shapes
    ]
