"""A hand-written designer and controller for lift cup.

Shapes: `B` batch (may be absent), `O` observation, `D` = 5 design, `C` = 3 control.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from codesign_bench.task import Behaviour, Booleans, Singles

from ..lift_cup import CUP_HEIGHT, CUP_UNIT, CUP_WIDTH, MAX_MOVE, PRONGS_TO_CUP_XY, RIM_WIDTH, LiftCup


class LiftCupScript(Behaviour):
    """Brings the prongs' middle, or the cross bar, up to the cup with the prongs at its sides; then lifts."""

    TOLERANCE = 0.004
    """The held end this near to its aim lifts, m."""
    BAR_DISTANCE = 0.005
    """Free way that the cross bar leaves before the cup's wall, m."""
    LIFTED = 0.003
    """A cup this high is on its way up, whatever its place, m."""
    PRONGS: ClassVar[tuple[float, ...]] = (0.0, 0.015, 0.2, 0.04)
    """Tilt (rad), width, length and height (m) of the script's own tools."""

    def __init__(self, task: LiftCup) -> None:
        self.task = task

    def design(self, observation: Singles) -> Singles:
        """Return long level prongs whose inner faces pass under the middle of the rim."""
        goal = self.task.layout.split(np.atleast_2d(observation)).goal
        width = CUP_UNIT * goal[:, CUP_WIDTH]
        designs = np.column_stack([width + RIM_WIDTH, np.tile(self.PRONGS, (len(goal), 1))])
        result: Singles = self.task.design_space.to_unit(designs).astype(np.float32)
        return result if observation.ndim == 2 else result[0]

    def act(self, observation: Singles) -> Singles:
        """Return the held end's move, normalised."""
        seen = self.task.layout.split(np.atleast_2d(observation).astype(np.float64))
        _, tilt, _, length, _ = self.task.design_space.from_unit(seen.design).T
        width = CUP_UNIT * seen.goal[:, CUP_WIDTH]
        # Short prongs cannot have their middle at the cup's: the cross bar would run into its wall before that.
        short_of_cup = np.maximum(0.0, 0.5 * width + self.BAR_DISTANCE - 0.5 * length * np.cos(tilt))
        way = seen.state[:, PRONGS_TO_CUP_XY] - np.column_stack([0.0 * width, short_of_cup])
        rising = seen.state[:, CUP_HEIGHT] > self.LIFTED
        there: Booleans = (np.abs(way) < self.TOLERANCE).all(axis=1) | rising
        moves = np.column_stack([way / MAX_MOVE, there])
        result: Singles = np.clip(moves, -1.0, 1.0).astype(np.float32)
        return result if observation.ndim == 2 else result[0]
