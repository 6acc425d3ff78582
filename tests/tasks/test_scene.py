"""What all tasks share, by hand: the physics steps of a control step, and starts clear of an object."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import pytest

scene: Any = import_module("codesign_bench.tasks._scene")
NONE = (np.nan, np.nan)
"""An interval that is not there."""


def test_a_refined_clock_cuts_the_same_time_into_more_steps() -> None:
    clock = scene.Clock(steps=4, period=0.01)
    assert clock.control_period == 0.04
    assert clock.refined(3).steps == 12
    assert clock.refined(3).control_period == pytest.approx(clock.control_period)


@pytest.mark.parametrize(
    ("blocked", "shift"),
    [
        ([NONE, NONE], 0.0),  # nothing is in the way
        ([(1.0, 2.0), NONE], 0.0),  # nothing is in the way at zero
        ([(-1.0, 2.0), NONE], -1.0),  # the nearer end
        ([(-2.0, 1.0), NONE], 1.0),
        ([(-1.0, 3.0), (-4.0, -0.5)], 3.0),  # the nearer end is in another interval
        ([(-3.0, 1.0), (1.0, 2.0)], 1.0),  # the ends of an interval are clear
    ],
)
def test_the_nearest_clear_shift_by_hand(blocked: list[tuple[float, float]], shift: float) -> None:
    low, high = np.array([blocked]).transpose(2, 0, 1)
    assert scene.nearest_clear_shift(low, high).tolist() == [shift]


def test_a_shift_stays_in_the_allowed_range() -> None:
    low, high = np.array([[-1.0]]), np.array([[2.0]])
    assert scene.nearest_clear_shift(low, high, (-0.5, 2.5)).tolist() == [2.0]
    assert scene.nearest_clear_shift(low, high, (-1.0, 2.5)).tolist() == [-1.0], "its ends are allowed"


def test_every_episode_has_a_shift_of_its_own() -> None:
    low, high = np.array([[-1.0], [np.nan]]), np.array([[2.0], [np.nan]])
    assert scene.nearest_clear_shift(low, high).tolist() == [-1.0, 0.0]
