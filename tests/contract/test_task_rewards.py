"""Each check of a task's reward and success finds the fault that it is there for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from codesign_bench.contract import Check
from codesign_bench.contract import task_rewards as checks
from codesign_bench.task import Floats, Slots, Task
from contract_faults import FaultsOf
from sound import Sticks


def more_than_its_terms(self: Sticks, slots: Slots, controls: Floats) -> None:
    """Add to the reward what no term has."""
    Sticks.step(self, slots, controls)
    self.reward[slots] += 0.5


def at_any_time(self: Sticks, slots: Slots, controls: Floats) -> None:
    """Succeed although the condition does not hold."""
    Sticks.step(self, slots, controls)
    self.success[slots] = True


def failing(self: Sticks, slots: Slots, controls: Floats) -> None:
    """Fail at once."""
    Sticks.step(self, slots, controls)
    self.failure[slots] = True


def unnamed(self: Sticks, slots: Slots, controls: Floats) -> None:
    """Set success without a condition."""
    self.success[slots] = np.abs(self.tip[slots] - self.goal[slots]) < 0.05


def remembering(self: Sticks, slots: Slots, instances: Floats) -> None:
    """Begin without forgetting."""
    self.goal[slots], self.tip[slots], self.state[slots, 0] = instances[:, 0], 0.0, 0.0


@pytest.mark.parametrize(
    ("check", "changes", "found"),
    [
        (checks.reward_is_the_sum_of_its_terms, {"reward_terms": {"progress": "m"}}, "given progress, success"),
        (checks.reward_is_the_sum_of_its_terms, {"simulator": {"step": more_than_its_terms}}, "do not add up"),
        (checks.success_is_what_is_declared, {"success_conditions": {"near": "m"}}, "given: at_goal"),
        (
            checks.success_is_what_is_declared,
            {"simulator": {"step": at_any_time}},
            "after control step 1, success",
        ),
        (checks.success_is_what_is_declared, {"success_steps": 3}, "have held for 3 steps"),
        (checks.success_is_what_is_declared, {"simulator": {"step": failing}}, "`failure_condition` is empty"),
        (
            checks.success_is_what_is_declared,
            {"success_conditions": {}, "simulator": {"step": unnamed}},
            "it declares no `success_conditions`",
        ),
        (checks.new_episodes_forget, {"simulator": {"begin": remembering}}, "not zero: reward, "),
    ],
)
def test_what_is_wrong_is_found(task_faults: FaultsOf, check: Check[Task], changes: dict[str, Any], found: str) -> None:
    assert found in task_faults(check, **changes)
