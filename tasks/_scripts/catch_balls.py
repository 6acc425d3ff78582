"""A hand-written designer and controller for catch balls.

Shapes: `B` batch (may be absent), `O` observation, `D` = 5 design, `K` = 3 balls.
"""

from __future__ import annotations

import numpy as np

from codesign_bench.task import Behaviour, Singles

from .._planar import ANGLE_NAMES, LENGTH_NAMES, chain_points
from ..catch_balls import BALL, BALLS, FIRST_LINK_ANGLE, GRAVITY, HAND_START, LANDING, MAX_SPEED, NUM_BALLS, CatchBalls


class CatchBallsScript(Behaviour):
    """Brings the middle of whatever tool it is given beneath the balls that are still in the air."""

    PAN = (-1.0, 1.0, 1.0, 1.0, 1.0)
    """Normalised: a short stem, then two long links that make a pan on the right; on the left with other angles."""
    MIRROR = (1.0,) * len(LENGTH_NAMES) + (-1.0,) * len(ANGLE_NAMES)
    """Factors that turn a pan on the right into one on the left."""
    GAIN = 4.0
    """Hand's speed per distance, 1/s."""
    IN_THE_AIR = 1.0
    """A ball higher above the hand than this is still to be caught, m."""

    def __init__(self, task: CatchBalls) -> None:
        self.task = task

    def design(self, observation: Singles) -> Singles:
        """Return a pan on the side where the balls come down."""
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
        # Time until a ball is as high as the hand: the positive root of y + velocity_y t - g t^2 / 2 = 0.
        fall = (velocity_y + np.sqrt(velocity_y**2 + 2.0 * GRAVITY * np.maximum(y, 0.0))) / GRAVITY
        points = chain_points(self.task.design_space.from_unit(seen.design), FIRST_LINK_ANGLE)
        middle = 0.5 * (points[:, :, 0].min(axis=1) + points[:, :, 0].max(axis=1))
        count = in_the_air.sum(axis=1)
        way = ((x + velocity_x * fall) * in_the_air).sum(axis=1) / np.maximum(count, 1) - middle
        control = np.where(count > 0, self.GAIN / MAX_SPEED * way, 0.0)[:, None]
        result: Singles = np.clip(control, -1.0, 1.0).astype(np.float32)
        return result if observation.ndim == 2 else result[0]
