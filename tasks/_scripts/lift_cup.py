"""A hand-written designer and controller for lift cup.

Shapes: `B` batch (may be absent), `O` observation, `D` = 5 design, `C` = 3 control.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from codesign_bench.task import Behaviour, Booleans, Singles

from ..lift_cup import CUP_HEIGHT, CUP_UNIT, CUP_WIDTH, MAX_MOVE, PRONGS_TO_CUP_XY, RIM_WIDTH, LiftCup


class LiftCupScript(Behaviour):
    """Moves the prongs' middle, or the cross bar, up to the cup with the prongs at its sides, then lifts."""

    TOLERANCE = 0.004
    """The held end lifts when it is within this distance of its target, m."""
    BAR_DISTANCE = 0.005
    """Gap between the cross bar and the cup's wall, m."""
    LIFTED = 0.003
    """A cup at this height is being lifted, wherever it is, m."""
    PRONGS: ClassVar[tuple[float, ...]] = (0.0, 0.015, 0.2, 0.04)
    """Tilt (rad), width, length and height (m) of the script's tools."""

    def __init__(self, task: LiftCup) -> None:
        self.task = task

    def design(self, observation: Singles) -> Singles:
        """Return long, level prongs whose inner faces are below the middle of the rim."""
        goal = self.task.layout.split(np.atleast_2d(observation)).goal
        width = CUP_UNIT * goal[:, CUP_WIDTH]
        designs = np.column_stack([width + RIM_WIDTH, np.tile(self.PRONGS, (len(goal), 1))])
        result: Singles = self.task.design_space.to_unit(designs).astype(np.float32)
        return result if observation.ndim == 2 else result[0]

    def act(self, observation: Singles) -> Singles:
        """Return the displacement of the held end, normalised."""
        seen = self.task.layout.split(np.atleast_2d(observation).astype(np.float64))
        _, tilt, _, length, _ = self.task.design_space.from_unit(seen.design).T
        width = CUP_UNIT * seen.goal[:, CUP_WIDTH]
        # The middle of short prongs cannot reach the cup's centre: the cross bar would hit the wall before.
        short_of_cup = np.maximum(0.0, 0.5 * width + self.BAR_DISTANCE - 0.5 * length * np.cos(tilt))
        way = seen.state[:, PRONGS_TO_CUP_XY] - np.column_stack([0.0 * width, short_of_cup])
        rising = seen.state[:, CUP_HEIGHT] > self.LIFTED
        # Once the cup rises the script keeps lifting, even if the cup moves away from the target position.
        there: Booleans = (np.abs(way) < self.TOLERANCE).all(axis=1) | rising
        moves = np.column_stack([way / MAX_MOVE, there])
        result: Singles = np.clip(moves, -1.0, 1.0).astype(np.float32)
        return result if observation.ndim == 2 else result[0]
