"""A method on a task: steps that are counted, and what differs between two states."""

from __future__ import annotations

import numpy as np

from codesign_bench.contract.subject import BUDGET, CountingTask, Subject, differing_state, unlike
from sound import SoundReach, SoundSearch

SUBJECT = Subject(SoundSearch, SoundReach())


def test_every_built_tool_and_every_step_is_counted() -> None:
    counting = CountingTask(SUBJECT.task)
    simulator, slots = counting.task.make_simulator(5), np.arange(3)
    simulator.begin(slots, np.zeros((3, 1)))
    simulator.build(slots, np.zeros((3, 1)))
    simulator.step(slots[:2], np.zeros((2, 1)))
    assert counting.env_steps == 5


def test_arrays_that_differ_are_named() -> None:
    first = {"same": np.array([1.0, np.nan]), "other": np.zeros(2), "gone": np.zeros(1), "whole": np.arange(2)}
    second = {"same": np.array([1.0, np.nan]), "other": np.ones(2), "new": np.zeros(1), "whole": np.arange(3)}
    assert unlike(first, second) == ["other", "gone", "whole", "new"]


def test_states_differ_after_a_batch_and_agree_before() -> None:
    first, second = SUBJECT.make(), SUBJECT.make()
    assert differing_state(first, second) == []
    second.train(BUDGET)
    assert "env_steps" in differing_state(first, second)


def test_policies_that_act_unlike_are_found() -> None:
    same, other = SUBJECT.make().policy(), SUBJECT.make(seed=1).policy()
    assert list(SUBJECT.acting_unlike(same, SUBJECT.make().policy(), "it")) == []
    assert {fault.found for fault in SUBJECT.acting_unlike(same, other, "it")} == {
        "it gives another design",
        "it gives another control",
    }
