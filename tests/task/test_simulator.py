"""What every simulator keeps of its slots: named terms of the reward, conditions of success, and how they are reset."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.task import Simulator, load_task

FIRST, BOTH = np.array([0]), np.array([0, 1])


@pytest.fixture
def simulator(toy: None) -> Simulator:
    """A simulator of three slots; what the toy itself does makes no difference here."""
    return load_task("toy_reach").make_simulator(3)


def test_named_terms_add_up_to_the_reward_of_the_slots_that_took_a_step(simulator: Simulator) -> None:
    simulator.set_reward(np.array([0, 2]), progress=np.array([1.0, 2.0]), slack=-0.25)
    assert simulator.reward.tolist() == [0.75, 0.0, 1.75]
    assert {name: values.tolist() for name, values in simulator.reward_terms.items()} == {
        "progress": [1.0, 0.0, 2.0],
        "slack": [-0.25, 0.0, -0.25],
    }


def test_terms_are_added_in_the_order_given(simulator: Simulator) -> None:
    simulator.set_reward(FIRST, first=np.array([0.1]), second=np.array([0.2]), third=np.array([-0.3]))
    assert simulator.reward[0] == (0.1 + 0.2) - 0.3 != 0.1 + (0.2 - 0.3)


def test_a_slot_is_solved_once_all_conditions_hold_for_long_enough_in_a_row(simulator: Simulator) -> None:
    solved = []
    for at_goal in (True, False, True, True, True):
        simulator.set_success(FIRST, 2, at_goal=np.array([at_goal]), at_rest=np.array([True]))
        assert simulator.conditions["at_goal"][0] == at_goal
        solved.append(bool(simulator.success[0]))
    assert solved == [False, False, False, True, True]
    assert simulator.met_steps.tolist() == [3, 0, 0]


def test_one_condition_that_holds_now_is_enough_by_default(simulator: Simulator) -> None:
    simulator.set_success(BOTH, at_goal=np.array([False, True]))
    assert simulator.success.tolist() == [False, True, False]


def test_a_slot_forgets_its_last_episode_and_the_others_keep_theirs(simulator: Simulator) -> None:
    simulator.set_success(BOTH, at_goal=np.array([True, True]))
    simulator.set_reward(BOTH, progress=np.array([1.0, 2.0]))
    simulator.outcome[:], simulator.failure[:] = 5.0, True
    simulator.forget(FIRST)
    for values, kept in (
        (simulator.reward, 2.0),
        (simulator.reward_terms["progress"], 2.0),
        (simulator.conditions["at_goal"], True),
        (simulator.met_steps, 1),
        (simulator.success, True),
        (simulator.failure, True),
        (simulator.outcome, 5.0),
    ):
        assert not values[0]
        assert values[1] == kept
