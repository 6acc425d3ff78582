"""Each check of a task's physics finds the fault that it is there for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from codesign_bench.contract import Check
from codesign_bench.contract import task_physics as checks
from codesign_bench.task import Booleans, Floats, Frame, Physics, Slots, Soundness, Task
from contract_faults import FaultsOf
from sound import Sticks


def seen(**changes: Any) -> dict[str, Any]:
    """Return a change of what is measured of a scene."""
    return {"simulator": {"inspect": lambda self, slot: Physics(**{**vars(SCENE), **changes})}}


SCENE = Physics(overlap=0.0, speed=0.5, contained=True)


def coarse(self: Sticks, slots: Slots, controls: Floats) -> None:
    """Move further the finer the steps are."""
    Sticks.step(self, slots, controls)
    self.outcome[slots] += self.refinement


def never(self: Sticks, slots: Slots, **conditions: Booleans) -> None:
    """Solve nothing, so that the episode is long."""


def touching(self: Sticks, slot: int) -> Frame:
    """Move what it draws."""
    self.tip[slot] += 0.1
    return Sticks.render(self, slot)


@pytest.mark.parametrize(
    ("check", "changes", "found"),
    [
        (checks.limits_are_kept, seen(overlap=0.3), "overlaps something by 0.3 m right after the design step"),
        (checks.limits_are_kept, seen(speed=7.0), "the fastest body moves at 7 m/s"),
        (checks.limits_are_kept, seen(speed=0.0), "the fastest body moves at 0 m/s"),
        (checks.limits_are_kept, seen(contained=False), "a body is on the wrong side"),
        (checks.limits_are_kept, {"soundness": None}, "it promises nothing of its physics"),
        (checks.physics_steps_are_short, {"simulator": {"step": coarse}}, "the median episode's outcome changes by 1"),
        (
            checks.physics_steps_are_short,
            {"simulator": {"step": coarse}, "soundness": Soundness(0.0, 1.0, 1e-6, chaotic=True)},
            "the mean outcome changes by 1\noutcomes have another distribution",
        ),
        (checks.looking_changes_nothing, {"simulator": {"render": touching}}, "looked at goes another way"),
        (
            checks.looking_changes_nothing,
            {"simulator": {"render": lambda self, slot: np.zeros((2, 2), np.uint8)}},
            "a picture of shape (2, 2)",
        ),
        (
            checks.looking_changes_nothing,
            {"simulator": {"render": lambda self, slot: np.zeros((2, 2, 3), np.uint8), "set_success": never}},
            "a picture of two colours or one\npictures 6 control steps apart are the same",
        ),
    ],
)
def test_what_is_wrong_is_found(task_faults: FaultsOf, check: Check[Task], changes: dict[str, Any], found: str) -> None:
    assert found in task_faults(check, **{"horizon": 12, "name": "sound_reach", **changes})
