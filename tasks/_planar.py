"""What the planar tasks share: the three-link chain tool and a simulator with one pymunk space per slot.

Shapes: `B` slots, `b` the slots a call names, `D` = 5 design parameters (l1, l2, l3, theta1, theta2).
Lengths are in m, angles in rad, times in s. The chain is the paper's (section "Tool design space").
"""

from __future__ import annotations

from abc import abstractmethod
from itertools import pairwise

import numpy as np
import pymunk
from pymunk import batch

from codesign_bench.task import Box, Floats, Simulator, Slots, ToolGraph

LINK_HALF_WIDTH = 0.25
"""Half the thickness of a link, m (ours)."""

CHAIN_GRAPH = ToolGraph(num_nodes=3, edges=((0, 1), (1, 2)), parameter_nodes=(0, 1, 2, 1, 2))
"""Three links in a row; the robot holds the free end of link 0; a joint's angle belongs to the link behind it."""


def chain_design_space(
    length_init: tuple[float, float, float],
    length_ratio: tuple[float, float],
    angle_scale: float,
    angle_ratio: tuple[float, float],
) -> Box:
    """Return a chain's design space: length = init (1 + ratio), angle = scale ratio; `angle_scale` in degrees."""
    lengths = {
        f"link_{index + 1}_length": (length * (1.0 + length_ratio[0]), length * (1.0 + length_ratio[1]), "m")
        for index, length in enumerate(length_init)
    }
    low, high = (float(np.deg2rad(angle_scale * ratio)) for ratio in angle_ratio)
    return Box.of(**lengths, joint_1_angle=(low, high, "rad"), joint_2_angle=(low, high, "rad"))


def chain_points(designs: Floats, first_link_angle: float) -> Floats:
    """Return the (b, 4, 2) points of chains (b, D) from the held end, at the origin, to the tip; m.

    The first link points along `first_link_angle` (rad, from the x axis); each joint turns the rest of the chain.
    """
    headings = first_link_angle + np.cumsum(np.pad(designs[:, 3:], ((0, 0), (1, 0))), axis=1)
    steps = designs[:, :3, None] * np.stack([np.cos(headings), np.sin(headings)], axis=-1)
    points = np.zeros((len(designs), 4, 2))
    np.cumsum(steps, axis=1, out=points[:, 1:])
    return points


class PlanarSimulator(Simulator):
    """One pymunk space per slot, built anew for every episode so that nothing of the last one can reach the next.

    All bodies of all slots are read with one buffer. A subclass fills each space in `build_space`, its moving bodies
    first the same in every episode.
    """

    def __init__(self, num_slots: int, state_size: int, num_bodies: int) -> None:
        super().__init__(num_slots, state_size)
        self.spaces: list[pymunk.Space] = [pymunk.Space() for _ in range(num_slots)]
        self.bodies: Floats = np.zeros((num_slots, num_bodies, 4))
        """(B, bodies, 4): x, y (m), vx, vy (m/s) of the bodies that `build_space` added, in its order."""
        self._buffer = batch.Buffer()

    @abstractmethod
    def build_space(self, slot: int, points: Floats) -> pymunk.Space:
        """Return a fresh space for the slot's episode with the tool whose chain has `points` (4, 2), held end first."""

    def add_spaces(self, slots: Slots, points: Floats) -> None:
        """Build the spaces of `slots` for tools with chain `points` (b, 4, 2)."""
        for slot, chain in zip(slots.tolist(), points, strict=True):
            self.spaces[slot] = self.build_space(slot, chain)

    def advance(self, slots: Slots, time_step: float, count: int) -> None:
        """Step the spaces of `slots` `count` times by `time_step` seconds."""
        for slot in slots.tolist():
            step = self.spaces[slot].step
            for _ in range(count):
                step(time_step)

    def read_bodies(self, slots: Slots) -> Floats:
        """Read positions and velocities of the bodies of `slots` into `bodies`; return them, (b, bodies, 4)."""
        self._buffer.clear()
        fields = batch.BodyFields.POSITION | batch.BodyFields.VELOCITY
        for slot in slots.tolist():
            batch.get_space_bodies(self.spaces[slot], fields, self._buffer)
        rows = np.frombuffer(self._buffer.float_buf()).reshape(len(slots), -1, 4)
        # The space's own static body comes last; without sleeping, the others keep the order they were added in.
        self.bodies[slots] = rows[:, : self.bodies.shape[1]]
        return self.bodies[slots]


def chain_tool(points: Floats, friction: float) -> tuple[pymunk.Body, list[pymunk.Segment]]:
    """Return a kinematic body with one rounded segment per link of the chain `points` (4, 2); links never collide."""
    body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    corners = [tuple(point) for point in points.tolist()]
    links = [pymunk.Segment(body, *ends, LINK_HALF_WIDTH) for ends in pairwise(corners)]
    for link in links:
        link.friction = friction
    return body, links
