"""The gantry that holds tools in training: where it puts them, how it moves them, and what stops it.

The engine's steps are 1/240 s long. The gantry slides along x, y and z and turns about z.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from importlib import import_module
from typing import Any

import pytest

from codesign_bench.task.robot import ArmReport

carriers: Any = import_module("codesign_bench.tasks._carriers")
pybullet: Any = import_module("pybullet")

STEPS_PER_SECOND = 240
SIDE = 0.02
"""Half a side of the cube that is held, m."""


@pytest.fixture
def world() -> Iterator[int]:
    """An empty world without gravity."""
    number: int = pybullet.connect(pybullet.DIRECT)
    yield number
    pybullet.disconnect(number)


def held(world: int, pose: Sequence[float] = (0.0, 0.0, 0.0, 0.0)) -> Any:
    """Return a cube of 0.5 kg on a gantry of 50 N and 10 N m."""
    tool = carriers.ToolShape([(SIDE,) * 3], [(0.0, 0.0, 0.0)], [carriers.LEVEL], mass=0.5, friction=0.7)
    return carriers.Gantry(turning_axes=[2], push_force=50.0, turn_torque=10.0).add(world, tool, pose)


def add_wall(world: int, x: float) -> None:
    """Put a fixed wall whose left face is at x."""
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=(0.1, 1.0, 1.0), physicsClientId=world)
    pybullet.createMultiBody(0.0, shape, basePosition=(x + 0.1, 0.0, 0.0), physicsClientId=world)


def test_a_tool_starts_at_its_pose(world: int) -> None:
    pose = [0.1, -0.2, 0.3, 0.4]
    tool = held(world, pose)
    assert tool.read() == pytest.approx(pose)
    state = pybullet.getLinkState(tool.body, tool.tool_link, computeForwardKinematics=True, physicsClientId=world)
    assert state[4] == pytest.approx(pose[:3], abs=1e-6)
    assert pybullet.getEulerFromQuaternion(state[5]) == pytest.approx((0.0, 0.0, 0.4), abs=1e-6)


def test_a_driven_tool_moves_at_the_commanded_velocity_and_turns(world: int) -> None:
    tool = held(world)
    tool.drive([0.12, -0.24, 0.06, 0.48])
    tool.advance(STEPS_PER_SECOND // 2)
    assert tool.read() == pytest.approx([0.06, -0.12, 0.03, 0.24], rel=0.02)
    tool.drive([0.0] * 4)
    tool.advance(1)
    there = tool.read()
    tool.advance(20)
    assert tool.read() == pytest.approx(there, abs=1e-3)


def test_a_blocked_tool_stops_instead_of_pressing_through(world: int) -> None:
    add_wall(world, x=0.05)
    tool = held(world)
    tool.drive([0.5, 0.0, 0.0, 0.0])
    tool.advance(STEPS_PER_SECOND)  # would go half a metre
    assert tool.read()[0] == pytest.approx(0.05 - SIDE, abs=2e-3)


def test_the_tool_has_its_mass_and_friction_and_the_carriages_little_mass(world: int) -> None:
    tool = held(world)
    masses = [pybullet.getDynamicsInfo(tool.body, link, physicsClientId=world)[0] for link in range(4)]
    assert masses == pytest.approx([carriers.CARRIAGE_MASS] * 3 + [0.5])
    assert pybullet.getDynamicsInfo(tool.body, tool.tool_link, physicsClientId=world)[1] == pytest.approx(0.7)


def test_nothing_is_reported_of_a_gantry(world: int) -> None:
    tool = held(world)
    tool.drive([9.0] * 4)
    tool.advance(5)
    assert tool.report == ArmReport()
