"""A hand-written designer and controller for catch balls.

Shapes: `B` batch (may be absent), `O` observation, `D` = 5 design, `K` = 3 balls.
"""

from __future__ import annotations

import numpy as np

from codesign_bench.task import Behaviour, Singles

from .._planar import ANGLE_NAMES, LENGTH_NAMES, chain_points
from ..catch_balls import BALL, BALLS, FIRST_LINK_ANGLE, GRAVITY, HAND_START, LANDING, MAX_SPEED, NUM_BALLS, CatchBalls


class CatchBallsScript(Behaviour):
    """Moves the middle of any tool beneath the balls that are still in the air."""

    PAN = (-1.0, 1.0, 1.0, 1.0, 1.0)
    """Normalised design: a short stem, then two long links that form a pan on the right, or mirrored on the left."""
    MIRROR = (1.0,) * len(LENGTH_NAMES) + (-1.0,) * len(ANGLE_NAMES)
    """Factors that mirror a pan on the right to the left."""
    GAIN = 4.0
    """Speed of the hand per distance, 1/s."""
    IN_THE_AIR = 1.0
    """A ball higher above the hand than this counts as in the air, m."""

    def __init__(self, task: CatchBalls) -> None:
        self.task = task

    def design(self, observation: Singles) -> Singles:
        """Return a pan on the side where the balls land."""
        right = self.task.layout.split(observation).goal[..., LANDING, None] > HAND_START[0]
        pan, mirror = np.array(self.PAN, dtype=np.float32), np.array(self.MIRROR, dtype=np.float32)
        tools: Singles = np.where(right, pan, pan * mirror)
        return tools

    def act(self, observation: Singles) -> Singles:
        """Return the hand's velocity, normalised."""
        seen = self.task.layout.split(np.atleast_2d(observation).astype(np.float64))
        balls = seen.state[:, BALLS].reshape(-1, NUM_BALLS, BALL.size)
        x, y, velocity_x, velocity_y, held = np.moveaxis(balls, 2, 0)  # as in BALL
        in_the_air = (y > self.IN_THE_AIR) & (held < 0.5)
        # Time until a ball is at the height of the hand: the positive root of y + velocity_y t - g t^2 / 2 = 0. Below
        # the hand there is none: y is set to 0, and such a ball is masked out below.
        fall = (velocity_y + np.sqrt(velocity_y**2 + 2.0 * GRAVITY * np.maximum(y, 0.0))) / GRAVITY
        points = chain_points(self.task.design_space.from_unit(seen.design), FIRST_LINK_ANGLE)
        middle = 0.5 * (points[:, :, 0].min(axis=1) + points[:, :, 0].max(axis=1))
        count = in_the_air.sum(axis=1)
        # The tool aims at the mean landing place of the balls in the air, with the middle of its extent rather than the
        # held point: the hand is at one end of a pan.
        way = ((x + velocity_x * fall) * in_the_air).sum(axis=1) / np.maximum(count, 1) - middle
        control = np.where(count > 0, self.GAIN / MAX_SPEED * way, 0.0)[:, None]
        result: Singles = np.clip(control, -1.0, 1.0).astype(np.float32)
        return result if observation.ndim == 2 else result[0]
