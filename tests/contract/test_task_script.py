"""Each check of a task's script finds the fault that it is there for."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.contract import Check
from codesign_bench.contract import task_script as checks
from codesign_bench.task import Floats, Singles, Slots, Task
from codesign_bench.task.behaviours import Idle
from contract_faults import FaultsOf
from sound import Script, Sticks


class Averaging(Script):
    """Designs by the mean of what it sees in a batch."""

    def design(self, observation: Singles) -> Singles:
        """Return the mean design."""
        designs = super().design(observation)
        return designs if designs.ndim == 1 else np.broadcast_to(designs.mean(axis=0), designs.shape)


class Wild(Script):
    """Designs beyond the bounds."""

    def design(self, observation: Singles) -> Singles:
        """Return three times as much."""
        return 3.0 + super().design(observation)


class Flat(Script):
    """Forgets the entries."""

    def design(self, observation: Singles) -> Singles:
        """Return (B,) designs."""
        return super().design(observation)[..., 0]


def no_tool(self: Sticks, slots: Slots, designs: Floats) -> None:
    """Build nothing."""


@pytest.mark.parametrize(
    ("script", "found"),
    [
        (Averaging, "the design for one observation differs"),
        (Wild, "of 3."),
        (Flat, "of shape (3,)"),
    ],
)
def test_what_is_no_function_of_an_observation_is_found(
    task_faults: FaultsOf, script: type[Script], found: str
) -> None:
    assert found in task_faults(checks.script_is_a_function, script=lambda self: script())


def test_a_script_that_solves_nothing_is_found(task_faults: FaultsOf) -> None:
    found = task_faults(
        checks.script_solves_some, script=lambda self: Idle(self), in_goal=None, sample_instances=far_goals
    )
    assert "it solves none of 8 evaluation instances" in found


def far_goals(self: Task, rng: np.random.Generator, count: int) -> Floats:
    """Return goals beyond an idle tool."""
    return rng.uniform(0.9, 1.0, size=(count, 1))


def test_tools_that_change_nothing_are_found(task_faults: FaultsOf) -> None:
    assert "random tools all reach" in task_faults(checks.script_solves_some, simulator={"build": no_tool})


def test_a_reward_for_not_solving_is_found(task_faults: FaultsOf) -> None:
    def late(self: Sticks, slots: Slots, controls: Floats) -> None:
        Sticks.step(self, slots, controls)
        self.success[slots] = self.goal[slots] < 0.5
        self.set_reward(slots, progress=np.zeros(len(slots)), success=2.0 * ~self.success[slots])

    assert "an unsolved episode returns 10, and a solved one 0" in task_faults(
        checks.script_solves_some, simulator={"step": late}
    )


@pytest.mark.parametrize("check", [checks.script_solves_some, checks.script_is_a_function])
def test_a_task_may_do_without_a_script(task_faults: FaultsOf, check: Check[Task]) -> None:
    assert task_faults(check, script=Task.script) == "it has no script"
