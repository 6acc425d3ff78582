"""An arm is found by its name, and what its gripper holds starts at the held point."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import pytest

from codesign_bench.errors import UserError
from codesign_bench.task.robot import ARMS, IDEAL, PANDA

deployed: Any = import_module("codesign_bench.tasks._deployed")
panda: Any = import_module("codesign_bench.tasks._panda")

BASE = (0.0, 0.1, 0.2)


def carrier(arm: str) -> Any:
    """Return what an arm's name means."""
    return deployed.arm_carrier(arm, BASE, None)


def test_the_ideal_arm_is_the_tasks_own_gantry() -> None:
    assert carrier(IDEAL) is None


def test_the_panda_is_the_simulated_arm() -> None:
    assert isinstance(carrier(PANDA), panda.PandaArm)


def test_an_unknown_arm_is_answered_with_those_there_are() -> None:
    with pytest.raises(UserError, match=f"unknown arm 'ur5'; choose from: {', '.join(ARMS)}"):
        carrier("ur5")


def test_the_handle_begins_at_the_held_point_and_each_part_touches_the_one_before() -> None:
    held_by = (0.0, 0.0, 0.0)
    for part in deployed.gripper_handle():
        reach = [(centre - half, centre + half) for centre, half in zip(part.centre, part.half_extents, strict=True)]
        assert all(low - 1e-9 <= place <= high + 1e-9 for (low, high), place in zip(reach, held_by, strict=True))
        held_by = (0.0, part.centre[1] - part.half_extents[1], 0.0)
