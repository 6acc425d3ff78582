"""A hand-written designer and controller for gather.

Shapes: `B` batch (may be absent), `O` observation, `D` = 7 design, `N` grains, `P` = 8 points.
"""

from __future__ import annotations

import numpy as np

from codesign_bench.task import Behaviour, Floats, Singles

from ..gather import GOAL, GRAIN, GRAINS, HAND, KNOTS_X, MAX_SPEED, NUM_GRAINS, SIDEWAYS, Gather, blade


class GatherScript(Behaviour):
    """Builds a bowl around the circle's x, brings a pocket before the circle, and pushes until the grains are there."""

    CURVATURE = 0.9
    """Normalised rise of a segment per distance from the bowl's deepest place, 1/m."""
    BEYOND = 0.25
    """How far behind the circle, as seen from the middle, the bowl is deepest: the heap leans on the longer wall, m."""
    GAIN = 4.0
    """Speed of the hand per distance, 1/s."""
    NEAR = 2.0
    """So far before the circle, the hand turns from the place of the pocket to the middle of the grains, m."""

    def __init__(self, task: Gather) -> None:
        self.task = task

    def design(self, observation: Singles) -> Singles:
        """Return a bowl around a place near the circle's x: the farther a segment is from there, the steeper."""
        goal_x = self.task.layout.split(observation).goal[..., GOAL.start, None].astype(np.float64)
        deepest = goal_x + self.BEYOND * np.sign(goal_x)
        middles = 0.5 * (KNOTS_X[1:] + KNOTS_X[:-1])
        blades: Singles = np.clip(self.CURVATURE * (middles - deepest), -1.0, 1.0).astype(np.float32)
        return blades

    def act(self, observation: Singles) -> Singles:
        """Return the hand's velocity, normalised."""
        seen = self.task.layout.split(np.atleast_2d(observation).astype(np.float64))
        goal, hand = seen.goal[:, GOAL], seen.state[:, HAND]
        middle = seen.state[:, GRAINS].reshape(-1, NUM_GRAINS, GRAIN.size)[..., :2].mean(axis=1)
        near = goal[:, 1] - middle[:, 1] < self.NEAR
        aim = np.where(near, hand[:, 0] + goal[:, 0] - middle[:, 0], self._place(seen.design, goal[:, 0]))
        aim = np.clip(aim, -SIDEWAYS, SIDEWAYS)
        sideways = self.GAIN * (aim - hand[:, 0]) / MAX_SPEED[0]
        forwards = np.maximum(self.GAIN * (goal[:, 1] - middle[:, 1]) / MAX_SPEED[1], 0.0)
        result: Singles = np.clip(np.stack([sideways, forwards], axis=1), -1.0, 1.0).astype(np.float32)
        return result if observation.ndim == 2 else result[0]

    def _place(self, designs: Floats, goal_x: Floats) -> Floats:
        """Return the x (B,) of the hand at which a pocket of blades (B, D) is before goals (B,), whichever is near, m.

        A pocket is an end of a segment with both neighbours before it; a blade without one is held as it is.
        """
        y = blade(self.task.design_space.from_unit(designs))[..., 1]
        inner = y[:, 1:-1]
        pocket = (inner <= y[:, :-2]) & (inner <= y[:, 2:])
        way = np.where(pocket, goal_x[:, None] - KNOTS_X[1:-1], np.inf)
        nearest = np.take_along_axis(way, np.abs(way).argmin(axis=1)[:, None], axis=1)[:, 0]
        place: Floats = np.where(np.isfinite(nearest), nearest, 0.0)
        return place
