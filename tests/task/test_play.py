"""The loop that plays episodes, on sticks whose every step can be reckoned by hand."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.task import Behaviour, Task, load_task
from codesign_bench.task.behaviours import GivenDesigns, Idle
from codesign_bench.task.episodes import Episodes
from codesign_bench.task.play import designed, first_observations, play

GOALS = np.array([[1.0], [0.5]])


@pytest.fixture
def task(toy: None) -> Task:
    """A stick of 0.1 to 1 m shall touch a goal on a line."""
    return load_task("toy_reach")


def longest(task: Task) -> Behaviour:
    """Return a behaviour that makes sticks of 1 m and never moves them."""
    return GivenDesigns(np.ones((2, 1)), Idle(task))


def test_the_design_step_comes_first_and_an_episode_that_ended_takes_no_more_steps(task: Task) -> None:
    turns = list(play(Episodes(task, 2), longest(task), GOALS))
    # The first goal is touched in the first step; the second stick stays 0.5 m beyond its goal until the time limit.
    assert [turn.step for turn in turns] == [0, 1, 2, 3, 4, 5]
    assert [turn.slots.tolist() for turn in turns] == [[0, 1], [0, 1], [1], [1], [1], [1]]
    assert [turn.over.tolist() for turn in turns] == [[False, False], [True, False], [False], [False], [False], [True]]
    assert turns[0].reward.tolist() == [0.0, 0.0]
    np.testing.assert_allclose(np.concatenate([turn.reward for turn in turns[1:]]), [0.0, *[-0.5] * 5])


def test_whoever_watches_sees_the_episodes_as_they_stand(task: Task) -> None:
    episodes = Episodes(task, 2)
    elapsed = [episodes.elapsed.tolist() for _ in play(episodes, longest(task), GOALS)]
    assert elapsed[:3] == [[0, 0], [1, 1], [1, 2]]


def test_designs_and_controls_are_clipped(task: Task) -> None:
    class Wild(Behaviour):
        def design(self, observation: np.ndarray) -> np.ndarray:
            return np.full((len(observation), 1), 7.0, dtype=np.float32)

        act = design

    episodes = Episodes(task, 2)
    _, turn, *_ = play(episodes, Wild(), GOALS)
    assert episodes.designs.tolist() == [[1.0], [1.0]], "in metres, the longest stick"
    assert turn.controls.tolist() == [[1.0], [1.0]]


def test_a_behaviour_may_see_something_else_than_the_observation(task: Task) -> None:
    seen = []

    class Watching(Idle):
        def act(self, observation: np.ndarray) -> np.ndarray:
            seen.append(observation.copy())
            return super().act(observation)

    for _ in play(Episodes(task, 2), Watching(task), GOALS, lambda episodes, slots: -episodes.observation[slots]):
        pass
    assert (seen[0][:, 0] < 0.0).all(), "the tip's place, with the sign that was asked for"


def test_designs_are_told_in_units_and_nothing_moves(task: Task) -> None:
    episodes = Episodes(task, 2)
    np.testing.assert_allclose(
        designed(episodes, GivenDesigns(np.array([[-1.0], [0.0]]), Idle(task)), GOALS), [[0.1], [0.55]]
    )
    assert episodes.elapsed.tolist() == [0, 0]


def test_first_observations_show_the_goal_in_the_design_phase(task: Task) -> None:
    observation, layout = first_observations(Episodes(task, 2), GOALS), task.layout
    np.testing.assert_allclose(observation[:, layout.goal], GOALS)
    assert observation[:, layout.phase].tolist() == [[1.0, 0.0, 0.0]] * 2
