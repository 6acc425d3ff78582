"""Carriers hold and move a tool in a PyBullet world: here the gantry used in training, in `_panda.py` an arm.

Shapes: `K` boxes of a tool, `A` axes of the held point.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from codesign_bench.task import OURS, Given, constants
from codesign_bench.task.robot import ArmReport

try:
    import pybullet as pybullet
except ModuleNotFoundError:
    pybullet = None

MISSING = "" if pybullet else "3D tasks need pybullet, which is not installed: see Installation in README.md"
"""`Task.missing` of tasks in a PyBullet world: they can be described without it, but not played."""
LEVEL = (0.0, 0.0, 0.0, 1.0)
"""The identity rotation."""
CARRIAGE_MASS: Annotated[float, Given("kg", OURS)] = 0.1
"""Mass of each moving part of the gantry except the last, which is the tool."""
CARRIER_SCENE = constants(__name__)


@dataclass(frozen=True)
class ToolShape:
    """A rigid tool of boxes, in the frame of the held point."""

    half_extents: Sequence[Sequence[float]]
    """(K, 3), m."""
    centres: Sequence[Sequence[float]]
    """(K, 3), m."""
    rotations: Sequence[Sequence[float]]
    """(K, 4), quaternions (x, y, z, w)."""
    mass: float
    """kg."""
    friction: float


class HeldTool(ABC):
    """A tool in a world, and the robot that holds it."""

    body: int
    """PyBullet's index of the body that contains the tool as a link."""
    tool_link: int
    """Index of this link."""

    def __init__(self) -> None:
        self.report = ArmReport()
        """Events of the robot so far."""

    @abstractmethod
    def drive(self, velocity: Sequence[float]) -> None:
        """Command the held point's velocity (A,), m/s and rad/s, for the next control step."""

    @abstractmethod
    def advance(self, steps: int) -> None:
        """Take `steps` physics steps."""

    @abstractmethod
    def read(self) -> list[float]:
        """Return the pose (A,) of the held point, m and rad."""


class Carrier(ABC):
    """A kind of robot."""

    @abstractmethod
    def add(self, world: int | None, tool: ToolShape, pose: Sequence[float]) -> HeldTool:
        """Add the robot with a tool, held at `pose` (A,), to a world."""


def run(world: int | None, steps: int) -> None:
    """Take `steps` physics steps in a world."""
    step = pybullet.stepSimulation
    for _ in range(steps):
        step(world)


class Gantry(Carrier):
    """Sliding joints along x, y and z, then turning joints, and at their end the tool as one rigid shape.

    Its joint positions are the pose of the held point. Motors track a commanded velocity with limited force, so a
    blocked tool stops instead of pressing through.
    """

    def __init__(self, turning_axes: Sequence[int], push_force: float, turn_torque: float) -> None:
        self.turning_axes = tuple(turning_axes)
        self.forces = [push_force] * 3 + [turn_torque] * len(self.turning_axes)

    def add(self, world: int | None, tool: ToolShape, pose: Sequence[float]) -> HeldTool:
        """Add a gantry."""
        shape = pybullet.createCollisionShapeArray(
            shapeTypes=[pybullet.GEOM_BOX] * len(tool.half_extents),
            halfExtents=tool.half_extents,
            collisionFramePositions=tool.centres,
            collisionFrameOrientations=tool.rotations,
            physicsClientId=world,
        )
        # A chain of links, each with one joint and no offset; only the last has a shape. Joint positions are then the
        # pose of the held point, and each axis has its own motor with a known largest force.
        count = len(self.forces)
        body: int = pybullet.createMultiBody(
            0.0,
            -1,
            -1,
            [0.0, 0.0, 0.0],
            linkMasses=[CARRIAGE_MASS] * (count - 1) + [tool.mass],
            linkCollisionShapeIndices=[-1] * (count - 1) + [shape],
            linkVisualShapeIndices=[-1] * count,
            linkPositions=[[0.0, 0.0, 0.0]] * count,
            linkOrientations=[LEVEL] * count,
            linkInertialFramePositions=[[0.0, 0.0, 0.0]] * count,
            linkInertialFrameOrientations=[LEVEL] * count,
            linkParentIndices=list(range(count)),
            linkJointTypes=[pybullet.JOINT_PRISMATIC] * 3 + [pybullet.JOINT_REVOLUTE] * len(self.turning_axes),
            linkJointAxis=np.eye(3)[[0, 1, 2, *self.turning_axes]].tolist(),
            physicsClientId=world,
        )
        for axis, start in enumerate(pose):
            pybullet.resetJointState(body, axis, start, physicsClientId=world)
            pybullet.changeDynamics(
                body,
                axis,
                lateralFriction=tool.friction,
                linearDamping=0.0,
                angularDamping=0.0,
                jointDamping=0.0,
                physicsClientId=world,
            )
        return _OnGantry(world, body, self.forces)


class _OnGantry(HeldTool):
    """A tool at the end of a gantry."""

    def __init__(self, world: int | None, body: int, forces: list[float]) -> None:
        super().__init__()
        self.world, self.body, self._forces = world, body, forces
        self._axes = list(range(len(forces)))
        self.tool_link = self._axes[-1]

    def drive(self, velocity: Sequence[float]) -> None:
        """Set the motors."""
        pybullet.setJointMotorControlArray(
            self.body,
            self._axes,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=velocity,
            forces=self._forces,
            physicsClientId=self.world,
        )

    def advance(self, steps: int) -> None:
        """Take `steps` physics steps."""
        run(self.world, steps)

    def read(self) -> list[float]:
        """Return the joint positions."""
        return [joint[0] for joint in pybullet.getJointStates(self.body, self._axes, self.world)]
