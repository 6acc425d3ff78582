"""Two-phase episodes: the trade-off reward, and what a reward is the sum of."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.task import Task, load_task
from codesign_bench.task.episodes import Episodes, Tradeoff, portions

SLOTS = np.array([0, 1])
GOALS = np.array([[1.0], [0.5]])


@pytest.fixture
def task(toy: None) -> Task:
    """A stick of 0.1 to 1 m shall touch a goal on a line; its task names no terms of the reward."""
    return load_task("toy_reach")


def shortest(task: Task, tradeoff: Tradeoff | None) -> Episodes:
    """Return two episodes of sticks of 0.1 m, one control step after their design step."""
    episodes = Episodes(task, 2, tradeoff)
    episodes.begin(SLOTS, GOALS)
    episodes.design(SLOTS, np.full((2, 1), -1.0))
    assert episodes.reward_terms == {}
    episodes.control(SLOTS, np.zeros((2, 1)))
    return episodes


def test_the_tradeoff_reward_by_hand() -> None:
    material, effort = np.array([0.5, 0.0, 1.0]), np.array([0.2, 0.0, 1.0])
    # 2 [1 - (0.3 * 0.5 + 0.7 * 0.2)] = 2 (1 - 0.29) = 1.42; nothing used earns K; everything used earns nothing.
    np.testing.assert_allclose(Tradeoff(alpha=0.3, scale=2.0).reward(material, effort), [1.42, 2.0, 0.0], atol=1e-12)


def test_a_task_that_names_no_terms_has_one(task: Task) -> None:
    episodes = shortest(task, None)
    assert list(episodes.reward_terms) == ["task"]
    np.testing.assert_allclose(episodes.reward_terms["task"], [-0.9, -0.4])


def test_the_tradeoff_is_one_more_term(task: Task) -> None:
    episodes = shortest(task, Tradeoff(alpha=1.0, scale=2.0))
    assert list(episodes.reward_terms) == ["task", "tradeoff"]
    np.testing.assert_allclose(episodes.reward_terms["tradeoff"], 1.8)  # material 0.1: K (1 - alpha 0.1)


def test_many_episodes_are_played_in_portions_that_a_simulator_may_hold(task: Task) -> None:
    assert [len(part) for part in portions(2_500, task)] == [834, 833, 833]
    assert np.concatenate(portions(2_500, task)).tolist() == list(range(2_500))
