"""Each check of a task's episodes finds the fault that it is there for."""

from __future__ import annotations

from itertools import count
from typing import Any

import numpy as np
import pytest

from codesign_bench.contract import Check
from codesign_bench.contract import task_episodes as checks
from codesign_bench.task import Box, Floats, Slots, Task
from contract_faults import FaultsOf
from sound import Sticks

calls = count()


def neighbours(self: Sticks, slots: Slots, controls: Floats) -> None:
    """Move by one's own control, and a little by those of the others."""
    Sticks.step(self, slots, controls)
    self.state[slots, 0] += 0.01 * controls.mean()


def lasting(self: Sticks, slots: Slots, instances: Floats) -> None:
    """Begin where the last episode ended."""
    tip = self.tip[slots]
    Sticks.begin(self, slots, instances)
    self.state[slots, 0] = tip


def numbered(self: Sticks, slots: Slots, designs: Floats) -> None:
    """Make the tool depend on the slot."""
    Sticks.build(self, slots, designs)
    self.state[slots, 0] += 0.01 * slots


def no_tool(self: Sticks, slots: Slots, designs: Floats) -> None:
    """Build nothing."""


def no_control(self: Sticks, slots: Slots, controls: Floats) -> None:
    """Ignore the controls."""
    Sticks.step(self, slots, 0.0 * controls)


def broken(self: Sticks, slots: Slots, controls: Floats) -> None:
    """Divide by zero."""
    self.reward[slots] = 1.0 / float(0 * len(slots))


@pytest.mark.parametrize(
    ("check", "changes", "found"),
    [
        (checks.episodes_end, {"simulator": {"step": broken}}, "it raised ZeroDivisionError"),
        (checks.episodes_end, {"state_space": Box.of(tip=(-2.0, 2.0, "m"), foot=(0.0, 1.0, "m"))}, "a state of shape"),
        (
            checks.observations_stay_in_bounds,
            {"sample_instances": lambda s, r, n: r.uniform(2, 3, (n, 1))},
            "goal from 2.",
        ),
        (
            checks.states_stay_in_their_space,
            {"state_space": Box.of(tip=(5.0, 6.0, "m"))},
            "tip is outside of",
        ),
        (checks.episodes_do_not_depend_on_others, {"simulator": {"step": neighbours}}, "in a batch and alone"),
        (checks.episodes_do_not_depend_on_others, {"simulator": {"begin": lasting}}, "another episode has used"),
        (checks.episodes_do_not_depend_on_others, {"simulator": {"build": numbered}}, "in other slots"),
        (checks.designs_and_controls_matter, {"simulator": {"build": no_tool}}, "opposite designs changed no state"),
        (checks.designs_and_controls_matter, {"simulator": {"step": no_control}}, "opposite controls changed no state"),
    ],
)
def test_what_is_wrong_is_found(task_faults: FaultsOf, check: Check[Task], changes: dict[str, Any], found: str) -> None:
    assert found in task_faults(check, **changes)


def test_gymnasium_is_asked(task_faults: FaultsOf) -> None:
    def restless(self: Task, rng: np.random.Generator, count: int) -> Floats:
        return np.random.default_rng(next(calls)).uniform(size=(count, 1))

    assert "eterministic" in task_faults(checks.gymnasium_agrees, sample_instances=restless)
