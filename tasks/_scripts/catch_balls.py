"""A hand-written designer and controller for catch balls.

Shapes: `B` batch (may be absent), `O` observation, `D` = 5 design, `K` = 3 balls.
"""

from __future__ import annotations

import numpy as np

from codesign_bench.task import Behaviour, Singles

from .._planar import ANGLE_NAMES, LENGTH_NAMES, chain_points
from ..catch_balls import BALL, BALLS, FIRST_LINK_ANGLE, GRAVITY, HAND_START, LANDING, MAX_SPEED, NUM_BALLS, CatchBalls


class CatchBallsScript(Behaviour):
    """Moves any tool only as far as necessary to be beneath the balls that are still in the air."""

    PAN = (-1.0, 1.0, 1.0, 1.0, 1.0)
    """Normalised design: a short stem, then two long links that form a pan on the right, or mirrored on the left."""
    MIRROR = (1.0,) * len(LENGTH_NAMES) + (-1.0,) * len(ANGLE_NAMES)
    """Factors that mirror a pan on the right to the left."""
    GAIN = 4.0
    """Speed of the hand per distance, 1/s."""
    DEPTH = 1.5
    """Distance below the hand at which balls meet the tool, m."""
    IN_THE_AIR = -0.6
    """A ball higher above the hand than this counts as in the air, m."""
    MARGIN = 0.5
    """Smallest distance of a landing ball from either end of the tool, m."""

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
        # Time until a ball meets the tool: the positive root of y + depth + velocity_y t - g t^2 / 2 = 0.
        height = np.maximum(y + self.DEPTH, 0.0)
        fall = (velocity_y + np.sqrt(velocity_y**2 + 2.0 * GRAVITY * height)) / GRAVITY
        landing = x + velocity_x * fall
        points = chain_points(self.task.design_space.from_unit(seen.design), FIRST_LINK_ANGLE)
        left, right = points[:, :, 0].min(axis=1), points[:, :, 0].max(axis=1)
        margin = np.minimum(self.MARGIN, 0.5 * (right - left))
        # The ways after which the tool is beneath all balls so far; they arrive in this order.
        least, most = np.full(len(x), -np.inf), np.full(len(x), np.inf)
        for ball in range(NUM_BALLS):
            first, last = landing[:, ball] - right + margin, landing[:, ball] - left - margin
            first, last = np.clip(first, least, most), np.clip(last, least, most)
            least, most = np.where(in_the_air[:, ball], (first, last), (least, most))
        way = np.clip(0.0, least, most)
        result: Singles = np.clip(self.GAIN / MAX_SPEED * way, -1.0, 1.0)[:, None].astype(np.float32)
        return result if observation.ndim == 2 else result[0]
