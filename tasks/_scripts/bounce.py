"""A hand-written designer and controller for bounce.

Shapes: `B` batch (may be absent), `O` observation, `D` = 5 design, `K` = 3 balls, `P` = 8 points, `n` tries.
"""

from __future__ import annotations

import numpy as np

from codesign_bench.task import Behaviour, Floats, Singles

from .._strip import STRIP_HALF_WIDTH
from ..bounce import (
    BALL,
    BALL_RADIUS,
    BALLS,
    COLUMNS,
    GRAVITY,
    HAND,
    HOOP,
    MAX_SPEED,
    NUM_BALLS,
    RAIL,
    RESTITUTION,
    SHAPE,
    Bounce,
    bent_strip,
)


class BounceScript(Behaviour):
    """Calculates where balls come down after their first bounce, and chooses the strip and the hand's place by that."""

    SIDE = 0.8
    """Normalised length of both sides: long enough for all balls."""
    FIRST_GRID = (21, 11, 5)
    """Numbers of tilts, bends and curls that are tried first."""
    FINER_GRIDS = 4
    """Finer grids of five values each, around the best so far."""
    PLACES = np.linspace(-RAIL, RAIL, 33)
    """Places of the hand that are tried, m."""
    GAIN = 8.0
    """Speed of the hand per distance, 1/s."""
    MOST = 2.0
    """A ball that misses the hoop by more than this counts as missing by this, m."""

    def __init__(self, task: Bounce) -> None:
        self.task = task

    def design(self, observation: Singles) -> Singles:
        """Return the strip that brings the worst of the three balls nearest to the middle of the hoop."""
        if observation.ndim == 1:
            return self._design(observation)
        designs: Singles = np.stack([self._design(one) for one in observation])
        return designs

    def act(self, observation: Singles) -> Singles:
        """Return the hand's velocity, normalised."""
        if observation.ndim == 1:
            return self._act(observation)
        controls: Singles = np.stack([self._act(one) for one in observation])
        return controls

    def _design(self, observation: Singles) -> Singles:
        seen = self.task.layout.split(observation.astype(np.float64))
        balls = seen.state[BALLS].reshape(NUM_BALLS, BALL.size)[:, :4]
        # The hand will be beneath the balls' common place, as far as its rail allows.
        below = np.clip(np.mean(balls[:, 0] - np.array(COLUMNS)), -RAIL, RAIL)
        balls[:, 0] -= below
        hoop = seen.goal[HOOP] - np.array([below, 0.0])
        best, reach = np.zeros(3), np.ones(3)
        for counts in (self.FIRST_GRID, *[(5, 5, 5)] * self.FINER_GRIDS):
            axes = [np.linspace(-width, width, count) for width, count in zip(reach, counts, strict=True)]
            tries = np.clip(best + np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3), -1.0, 1.0)
            designs = np.full((len(tries), self.task.design_space.size), self.SIDE)
            designs[:, SHAPE] = tries
            missed = miss(bent_strip(self.task.design_space.from_unit(designs)), balls, hoop).max(axis=1)
            best = tries[missed.argmin()]
            reach = 2.0 * reach / (np.array(counts) - 1)
        result: Singles = np.full(self.task.design_space.size, self.SIDE, dtype=np.float32)
        result[SHAPE] = best
        return result

    def _act(self, observation: Singles) -> Singles:
        seen = self.task.layout.split(observation.astype(np.float64))
        hand = seen.state[HAND]
        balls = seen.state[BALLS].reshape(NUM_BALLS, BALL.size)
        falling = balls[(np.abs(balls[:, 2]) < 1e-6) & (balls[:, 3] <= 0.0) & (balls[:, 1] > 0.0), :4]
        if not len(falling):
            return np.zeros(self.task.control_space.size, dtype=np.float32)
        strip = bent_strip(self.task.design_space.from_unit(seen.design[None]))
        # A hand at another place is the same as balls and hoop that are moved the other way.
        moved = np.repeat(falling[None], len(self.PLACES), axis=0)
        moved[..., 0] += (hand - self.PLACES)[:, None]
        hoops = seen.goal[HOOP] - np.stack([self.PLACES, np.zeros_like(self.PLACES)], axis=1)
        missed = np.minimum(miss(strip, moved, hoops), self.MOST).sum(axis=1)
        # Of places that are equally good, the nearest.
        way = self.PLACES[(missed + 1e-3 * np.abs(self.PLACES - hand)).argmin()] - hand
        result: Singles = np.clip(self.GAIN / MAX_SPEED * way, -1.0, 1.0).reshape(1).astype(np.float32)
        return result


def miss(strips: Floats, balls: Floats, hoops: Floats) -> Floats:
    """Return how far from the hoops' middle (n, K) balls come down after one bounce, m.

    Args:
        strips: points (n, P, 2) relative to the hand, from left to right, m.
        balls: positions relative to the hand and velocities of falling balls (n, K, 4) or (K, 4), m and m/s.
        hoops: centres (n, 2) or (2,) relative to the hand, m.
    """
    start, link = strips[:, None, :-1], np.diff(strips, axis=1)[:, None]  # (n, 1, segments, 2)
    length = np.linalg.norm(link, axis=-1)
    along = link / length[..., None]
    normal = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    # A ball touches a segment when its centre is on the segment's line, moved along the normal by both radii.
    line = start + (BALL_RADIUS + STRIP_HALF_WIDTH) * normal
    x, y, speed = balls[..., 0, None], balls[..., 1, None], balls[..., 3, None]
    place = (x - line[..., 0]) / along[..., 0]
    height = line[..., 1] + place * along[..., 1]
    touches = (place > -0.02) & (place < length + 0.02) & (height < y)  # 2 cm for gaps at the corners of a dome
    first = np.where(touches, height, -np.inf).argmax(axis=2)[..., None]
    touched = np.take_along_axis(touches, first, axis=2)[..., 0]
    height = np.take_along_axis(height, first, axis=2)[..., 0]
    across = np.take_along_axis(np.broadcast_to(normal, (*touches.shape, 2)), first[..., None], axis=2)[:, :, 0]
    # Energy gives the speed of the impact; the bounce changes its part along the normal alone.
    impact = -np.sqrt(np.maximum(speed[..., 0] ** 2 + 2.0 * GRAVITY * (y[..., 0] - height), 0.0))
    push = -(1.0 + RESTITUTION) * impact * across[..., 1]
    velocity = push[..., None] * across
    velocity[..., 1] += impact
    rise = velocity[..., 1] ** 2 + 2.0 * GRAVITY * (height - hoops[..., None, 1])
    flight = (velocity[..., 1] + np.sqrt(np.maximum(rise, 0.0))) / GRAVITY
    # A ball that stays below the hoop misses it by the height that it lacks, plus the distance along x.
    lacking = np.maximum(-rise, 0.0) / (2.0 * GRAVITY)
    missed = np.abs(balls[..., 0] + velocity[..., 0] * flight - hoops[..., None, 0]) + lacking
    far: Floats = np.where(touched, missed, 10.0)
    return far
