"""A hand-written designer and controller for push.

Shapes: `B` batch (may be absent), `O` observation, `D` = 5 design, `P` points on a tool.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from codesign_bench.task import Behaviour, Floats, Singles

from .._planar import LINK_HALF_WIDTH, chain_points
from ..push import BASE, FIRST_LINK_ANGLE, GOAL_RADIUS, PUCK, PUCK_RADIUS, PUCK_TO_GOAL, WORKSPACE, Push


class PushScript(Behaviour):
    """Moves a point of the tool behind the puck as seen from the goal, then moves towards the goal.

    Every link has a few candidate points on both sides. The chosen point is near, and its side faces the goal. The tool
    moves there on a straight path and may push the puck aside, so performance depends on the tool's shape.
    """

    SHAPES: ClassVar[tuple[tuple[float, ...], ...]] = (
        (0.8, 0.9, -0.2, 0.2, 0.9),  # goals to the right: a long arm with a hook behind the puck
        (0.8, 0.9, -0.2, 0.2, 0.9),  # upper right: none of 500 random tools solves these with this controller
        (-0.4, 0.2, -0.3, 0.5, 0.2),  # above: a slanted arm that pushes the puck up while it moves to the left
        (-0.6, 0.8, -0.8, 0.4, -0.4),
        (-0.2, 0.8, -0.8, 0.4, 0.6),  # left: an arm down to the near side of the puck
        (-0.2, -0.8, -0.3, -0.6, 0.5),
        (0.9, -0.1, 0.8, -0.1, 0.5),  # below: a hollow arm above the puck
        (0.6, -0.8, 0.8, 0.5, -0.6),
    )
    """The best of 500 random tools for goals in each of eight directions, anticlockwise from the right."""
    POINTS_PER_LINK = 4
    NEARNESS = 0.15
    """Cost of a metre of way, in units of the cosine between a link's normal and the direction to the goal."""
    OUT_OF_REACH = 5.0
    """Cost of a metre outside of the workspace, in metres of way: the held end cannot get to such a place."""
    READY = 0.4
    """The held end moves towards the goal when it is within this distance of its place, m."""
    MAX_PUSH = 0.7
    """Largest normalised speed of a push."""

    def __init__(self, task: Push) -> None:
        self.task = task

    def design(self, observation: Singles) -> Singles:
        """Return one of eight tools for the goal's direction."""
        to_goal = self.task.layout.split(observation).state[..., PUCK_TO_GOAL]
        count = len(self.SHAPES)
        turn = np.arctan2(to_goal[..., 1], to_goal[..., 0]) / (2.0 * np.pi)
        shapes: Singles = np.array(self.SHAPES, dtype=np.float32)[np.round(count * turn).astype(int) % count]
        return shapes

    def act(self, observation: Singles) -> Singles:
        """Return the held end's velocity, normalised."""
        seen = self.task.layout.split(np.atleast_2d(observation).astype(np.float64))
        puck, base, to_goal = seen.state[:, PUCK], seen.state[:, BASE], seen.state[:, PUCK_TO_GOAL]
        distance = np.linalg.norm(to_goal, axis=1, keepdims=True)
        heading = to_goal / np.maximum(distance, 1e-9)
        points, sides = self._places(seen.design)
        # Position of the held end at which a link's point touches the puck and pushes it along `sides`: the chain does
        # not rotate, so point and held end keep the same offset.
        held = puck[:, None] - (PUCK_RADIUS + LINK_HALF_WIDTH) * sides - points
        reachable = np.clip(held, *WORKSPACE.bounds)
        missed = np.linalg.norm(reachable - held, axis=2)
        cost = np.linalg.norm(reachable - base[:, None], axis=2) + self.OUT_OF_REACH * missed
        score = (sides * heading[:, None]).sum(axis=2) - self.NEARNESS * cost
        way = held[np.arange(len(puck)), score.argmax(axis=1)] - base
        ready = np.linalg.norm(way, axis=1, keepdims=True) < self.READY
        # The push slows down before the goal, because a puck slides on after the link has stopped.
        speed = np.clip((distance - 0.5 * GOAL_RADIUS) / GOAL_RADIUS, 0.0, self.MAX_PUSH)
        control = np.where(ready, way + speed * heading, np.clip(way, -1.0, 1.0))
        result: Singles = np.clip(control, -1.0, 1.0).astype(np.float32)
        return result if observation.ndim == 2 else result[0]

    def _places(self, designs: Floats) -> tuple[Floats, Floats]:
        """Return points on the links, relative to the held end, and the directions of their push: (B, P, 2) each."""
        chain = chain_points(self.task.design_space.from_unit(designs), FIRST_LINK_ANGLE)
        link = chain[:, 1:] - chain[:, :-1]
        share = (np.arange(self.POINTS_PER_LINK) + 0.5) / self.POINTS_PER_LINK
        points = (chain[:, :-1, None] + share[:, None] * link[:, :, None]).reshape(len(designs), -1, 2)
        normal = np.stack([-link[..., 1], link[..., 0]], axis=-1) / np.linalg.norm(link, axis=-1, keepdims=True)
        sides = np.repeat(normal, self.POINTS_PER_LINK, axis=1)
        return np.concatenate([points, points], axis=1), np.concatenate([sides, -sides], axis=1)
