"""Behaviours that nobody trained."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.task import Task, load_task
from codesign_bench.task.behaviours import GivenDesigns, Idle, Joined, RandomBehaviour


@pytest.fixture
def task(toy: None) -> Task:
    """A stick with one design and one control entry."""
    return load_task("toy_reach")


def seen(task: Task, count: int) -> np.ndarray:
    """Return the observations of so many episodes; what is in them makes no difference here."""
    return np.zeros((count, task.layout.size), dtype=np.float32)


def test_designs_are_given_one_per_episode_or_one_for_all(task: Task) -> None:
    each = GivenDesigns(np.array([[0.1], [0.2]]), Idle(task))
    np.testing.assert_allclose(each.design(seen(task, 2)), [[0.1], [0.2]])
    same = GivenDesigns(np.array([0.3]), Idle(task))
    np.testing.assert_allclose(same.design(seen(task, 3)), [[0.3]] * 3)
    np.testing.assert_allclose(same.design(seen(task, 1)[0]), [0.3])


def test_the_controller_acts_whatever_the_designs(task: Task) -> None:
    behaviour = GivenDesigns(np.array([0.3]), RandomBehaviour(task, np.random.default_rng(0)))
    expected = RandomBehaviour(task, np.random.default_rng(0))
    np.testing.assert_array_equal(behaviour.act(seen(task, 4)), expected.act(seen(task, 4)))


def test_joined_behaviours_design_as_the_one_and_act_as_the_other(task: Task) -> None:
    joined = Joined(GivenDesigns(np.array([0.3]), RandomBehaviour(task, np.random.default_rng(0))), Idle(task))
    np.testing.assert_allclose(joined.design(seen(task, 2)), [[0.3]] * 2)
    assert joined.act(seen(task, 2)).tolist() == [[0.0], [0.0]]


def test_idle_is_the_middle_of_both_spaces(task: Task) -> None:
    assert Idle(task).design(seen(task, 2)).tolist() == [[0.0], [0.0]]
    assert Idle(task).act(seen(task, 2)).tolist() == [[0.0], [0.0]]


def test_random_controls_are_held_for_a_while(task: Task) -> None:
    behaviour = RandomBehaviour(task, np.random.default_rng(0))
    controls = [behaviour.act(seen(task, 1))[0, 0] for _ in range(2 * RandomBehaviour.HELD_STEPS)]
    assert len(set(controls[: RandomBehaviour.HELD_STEPS])) == 1
    assert len(set(controls)) == 2
    assert np.abs(controls).max() <= 1.0
