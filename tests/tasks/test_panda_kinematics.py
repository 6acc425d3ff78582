"""The Panda's kinematics by hand and there and back."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import pytest

pytestmark = pytest.mark.numeric

kinematics: Any = import_module("codesign_bench.tasks._panda_kinematics")


def test_inverse_kinematics_finds_postures_inside_the_limits() -> None:
    rng = np.random.default_rng(1)
    low, high = kinematics.LOWEST, kinematics.HIGHEST
    for _ in range(10):
        middle = 0.5 * (low + high)
        angles = middle + 0.5 * (rng.uniform(low, high) - middle)
        found = kinematics.solve(kinematics.hand_frame(angles), angles + 0.1, kinematics.READY)
        assert found.reached
        assert (found.angles >= low).all()
        assert (found.angles <= high).all()


def test_what_cannot_be_reached_is_said_to_be_so() -> None:
    far = kinematics.hand_frame(kinematics.READY)
    far[:3, 3] = (2.0, 0.0, 0.5)
    found = kinematics.solve(far, kinematics.READY, kinematics.READY)
    assert not found.reached
    assert found.place_error > 1.0


def test_the_stretched_arm_by_hand() -> None:
    # All joints at zero: up by 0.333 + 0.316 + 0.384, out and back by 0.0825, out by 0.088 and down by 0.107.
    frame = kinematics.hand_frame(np.zeros(7))
    assert frame[:3, 3] == pytest.approx([0.088, 0.0, 0.333 + 0.316 + 0.384 - 0.107])
    assert frame[:3, 2] == pytest.approx([0.0, 0.0, -1.0])  # the hand looks down


def test_the_first_joint_turns_the_whole_arm_about_the_upright() -> None:
    ahead, left = kinematics.READY.copy(), kinematics.READY.copy()
    left[0] = 0.5 * np.pi
    x, y, z = kinematics.hand_frame(ahead)[:3, 3]
    assert kinematics.hand_frame(left)[:3, 3] == pytest.approx([-y, x, z])
    assert y == pytest.approx(0.0)


def test_the_slopes_are_those_of_small_turns_of_each_joint() -> None:
    small = 1e-6
    slopes = kinematics.jacobian(kinematics.joint_frames(kinematics.READY))
    for joint, turn in enumerate(small * np.eye(7)):
        before, after = (kinematics.hand_frame(kinematics.READY + sign * turn) for sign in (-1.0, 1.0))
        rates = (after - before) / (2.0 * small)
        spin = rates[:3, :3] @ kinematics.hand_frame(kinematics.READY)[:3, :3].T
        by_hand = [*rates[:3, 3], spin[2, 1], spin[0, 2], spin[1, 0]]
        assert slopes[:, joint] == pytest.approx(by_hand, abs=1e-8)


def test_joints_that_would_leave_their_range_are_held_at_its_end() -> None:
    start = kinematics.READY.copy()
    start[5] = 4.5  # beyond what the sixth joint can do
    beyond = kinematics.hand_frame(start)
    found = kinematics.solve(beyond, kinematics.READY, kinematics.READY)
    assert (found.angles <= kinematics.HIGHEST).all()
    assert (found.angles >= kinematics.LOWEST).all()
    nothing_asked = kinematics.solve(kinematics.hand_frame(kinematics.READY), kinematics.READY, kinematics.READY)
    assert nothing_asked.angles == pytest.approx(kinematics.READY)
    assert not nothing_asked.at_limit.any()
    end = np.where(np.arange(7) == 5, kinematics.HIGHEST, kinematics.READY)
    assert kinematics.solve(kinematics.hand_frame(end), end, end).at_limit.tolist() == [False] * 5 + [True, False]


def test_a_posture_counts_as_reached_within_a_tenth_of_a_millimetre_and_a_thousandth_of_a_radian() -> None:
    def reached(place: float, turn: float) -> bool:
        return bool(kinematics.Posture(np.zeros(7), place, turn, np.zeros(7, dtype=bool)).reached)

    assert reached(0.9e-4, 0.9e-3)
    assert not reached(1.1e-4, 0.0)
    assert not reached(0.0, 1.1e-3)
