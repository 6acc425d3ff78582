"""Shared by bounce and gather: goals on two sides, left and right of a line, in mirrored rectangles.

Shapes: `b` goals, each (x, y), m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codesign_bench.task import Booleans, Floats


@dataclass(frozen=True)
class TwoSides:
    """Goals at a distance from the line x = 0, on either side of it, and at some y."""

    distance: tuple[float, float]
    """Smallest and largest distance from the line, m."""
    y: tuple[float, float]
    """Smallest and largest y, m."""

    def sample_x(self, rng: np.random.Generator, count: int) -> Floats:
        """Return (count,) random x, uniform in distance, left and right with equal probability."""
        distance = rng.uniform(*self.distance, size=count)
        x: Floats = distance * np.where(rng.random(count) < 0.5, -1.0, 1.0)
        return x

    def contain(self, goals: Floats) -> Booleans:
        """Return which goals (b, 2) are in one of the rectangles, borders included."""
        inside: Booleans = np.all([(share >= 0.0) & (share <= 1.0) for share in self._shares(goals)], axis=0)
        return inside

    def in_patches(self, goals: Floats, fraction: float) -> Booleans:
        """Return which goals (b, 2) are in the two patches, on the left and on the right, with `fraction` of the area.

        A patch is centred in distance and in y, with the same scale in both.
        """
        reach = 0.5 * np.sqrt(fraction)
        inside: Booleans = np.all([np.abs(share - 0.5) < reach for share in self._shares(goals)], axis=0)
        return inside

    def _shares(self, goals: Floats) -> list[Floats]:
        """Return where goals are in the ranges of distance and of y, (b,) each, from 0 to 1."""
        values = ((np.abs(goals[:, 0]), self.distance), (goals[:, 1], self.y))
        return [(value - low) / (high - low) for value, (low, high) in values]
