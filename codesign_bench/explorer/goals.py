"""The goals that a page offers: axes to drag along, and the grid of goals on which rollouts are recorded.

Shapes: `P` points, `X` axes, `I` instance, `H` hidden entries of an instance, `V` variations.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from codesign_bench.errors import UserError
from codesign_bench.task import Booleans, Floats, Task

MOST_VALUES = 32
"""An entry with only whole numbers, and no more different ones than these, is chosen from a list."""
VARIATION = "variation"
"""Name of the axis of what varies besides the goal."""
VARIATIONS_OF_A_LINE, VARIATIONS = 8, 2
"""Number of variations shown: of goals with one entry, where they are the map's other direction, and of others."""
MASK_SIDE = 96
"""Fields along each side of the map of the training region."""


@dataclass(frozen=True)
class Axis:
    """One direction in which a goal can be moved."""

    name: str
    unit: str
    low: float
    high: float
    values: tuple[float, ...] = ()
    """The only values, in order; empty: everything between `low` and `high`."""


@dataclass(frozen=True)
class Goals:
    """All goals of a page: points along its axes, which are the goal's entries and, if others vary, the variation."""

    task: Task
    axes: tuple[Axis, ...]
    hidden: Floats
    """(V, H) entries behind the goal; (1, 0) if there are none."""

    @classmethod
    def of(cls, task: Task) -> Goals:
        """Return the goals of `task`; its hidden entries are those of its first evaluation instances."""
        fixed, space = task.evaluation_instances(), task.goal_space
        axes = []
        for index, (name, unit) in enumerate(zip(space.names, space.units, strict=True)):
            seen = np.unique(fixed[:, index])
            whole = len(seen) <= MOST_VALUES and bool((seen == np.rint(seen)).all())
            values = tuple(seen.tolist()) if whole else ()
            low, high = (seen[0], seen[-1]) if whole else (space.low[index], space.high[index])
            axes.append(Axis(name, unit, float(low), float(high), values))
        count = VARIATIONS_OF_A_LINE if task.goal_size == 1 else VARIATIONS
        hidden = fixed[:count, task.goal_size :] if task.instance_space.size > task.goal_size else np.zeros((1, 0))
        if hidden.shape[1]:
            numbers = tuple(float(number) for number in range(len(hidden)))
            axes.append(Axis(VARIATION, "", numbers[0], numbers[-1], numbers))
        return cls(task, tuple(axes), hidden)

    @property
    def smooth(self) -> list[int]:
        """Positions of the axes without a list of values."""
        return [index for index, axis in enumerate(self.axes) if not axis.values]

    @property
    def listed(self) -> list[int]:
        """Positions of the axes with a list of values."""
        return [index for index, axis in enumerate(self.axes) if axis.values]

    @property
    def combinations(self) -> list[tuple[float, ...]]:
        """Every combination of the listed axes' values; the last axis changes fastest."""
        return list(product(*(self.axes[index].values for index in self.listed)))

    def instances(self, points: Floats) -> Floats:
        """Return the instances (P, I) of `points` (P, X)."""
        size = self.task.goal_size
        chosen = np.rint(points[:, size]).astype(int) if points.shape[1] > size else np.zeros(len(points), dtype=int)
        return np.concatenate([points[:, :size], self.hidden[chosen]], axis=1)

    def random_points(self, rng: np.random.Generator, count: int) -> Floats:
        """Return (count, X) points, uniform along every axis."""
        columns = [
            rng.choice(axis.values, count) if axis.values else rng.uniform(axis.low, axis.high, count)
            for axis in self.axes
        ]
        return np.stack(columns, axis=1)

    def grid(self, count: int) -> list[Floats]:
        """Return places along every axis whose combinations in the training region are about `count` points.

        Places divide an axis into fields of the same width and are in their middles.
        """
        fields = max(1, len(self.combinations))
        smooth = len(self.smooth)
        if not smooth:
            return [np.array(axis.values) for axis in self.axes]
        dense = product_of(self._places(round(4096 ** (1.0 / len(self.axes))) + 1))
        share = max(0.05, float(self.inside(dense).mean()))
        return self._places(max(2, round((count / fields / share) ** (1.0 / smooth))))

    def recorded(self, count: int) -> Floats:
        """Return the points (P, X) of the grid that are in the training region."""
        points = product_of(self.grid(count))
        return points[self.inside(points)]

    def inside(self, points: Floats) -> Booleans:
        """Return which points (P, X) are in the training region; all, for a task without one."""
        try:
            return self.task.in_region(self.instances(points))
        except UserError:
            return np.ones(len(points), dtype=bool)

    def mask(self) -> Booleans | None:
        """Return which fields (side, side) of the plane of the first two axes are in the training region.

        Rows go up along the second axis. None: all are, or there are other axes, or the second one has values.
        """
        if len(self.axes) != 2 or len(self.smooth) != 2:
            return None
        inside = self.inside(product_of(self._places(MASK_SIDE))).reshape(MASK_SIDE, MASK_SIDE).T
        return None if inside.all() else inside

    def _places(self, count: int) -> list[Floats]:
        middles = (np.arange(count) + 0.5) / count
        return [
            np.array(axis.values) if axis.values else axis.low + middles * (axis.high - axis.low) for axis in self.axes
        ]


def product_of(places: list[Floats]) -> Floats:
    """Return every combination (P, X) of places along the axes; the last axis changes fastest."""
    return np.stack([grid.ravel() for grid in np.meshgrid(*places, indexing="ij")], axis=1)
