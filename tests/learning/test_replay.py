"""The replay buffer holds the latest transitions and comes back from its arrays. Shapes: `n` transitions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from codesign_bench.learning.replay import ReplayBuffer, Transitions
from codesign_bench.learning.two_phase import TwoPhaseLearner
from codesign_bench.task import Task


def numbered(task: Task, first: int, count: int) -> Transitions:
    """Return transitions whose rewards are `first`, `first` + 1 and so on."""
    transitions = Transitions.empty(count, task)
    transitions.reward[:] = np.arange(first, first + count)
    transitions.observation[:] = transitions.reward[:, None]
    return transitions


def rewards(buffer: ReplayBuffer) -> list[float]:
    """Return the rewards of all transitions in the buffer, in ascending order."""
    return sorted(buffer.arrays()["reward"].tolist())


def test_transitions_are_the_valid_steps_of_a_batch(make_learner: Callable[..., TwoPhaseLearner]) -> None:
    batch = make_learner().collect(60, 4)
    found = Transitions.of(batch)
    assert len(found) == batch.env_steps
    np.testing.assert_array_equal(found.is_design, batch.is_design[batch.valid])
    np.testing.assert_array_equal(found.next_observation, batch.next_observation[batch.valid])
    np.testing.assert_array_equal(found.reward, np.float32(batch.reward[batch.valid]))
    assert not found.control[found.is_design].any()
    assert not found.design[~found.is_design].any()


def test_new_transitions_overwrite_the_oldest(reach: Task) -> None:
    buffer = ReplayBuffer(5, reach)
    buffer.add(numbered(reach, 0, 3))
    assert (len(buffer), rewards(buffer)) == (3, [0.0, 1.0, 2.0])
    buffer.add(numbered(reach, 3, 4))
    assert (len(buffer), rewards(buffer)) == (5, [2.0, 3.0, 4.0, 5.0, 6.0])
    buffer.add(numbered(reach, 7, 12))
    assert (len(buffer), rewards(buffer)) == (5, [14.0, 15.0, 16.0, 17.0, 18.0])


def test_samples_are_whole_transitions_of_those_that_are_held(reach: Task) -> None:
    buffer = ReplayBuffer(10, reach)
    buffer.add(numbered(reach, 1, 4))
    sample = buffer.sample(200, np.random.default_rng(0))
    assert set(sample.reward.tolist()) == {1.0, 2.0, 3.0, 4.0}
    np.testing.assert_array_equal(sample.observation, np.broadcast_to(sample.reward[:, None], sample.observation.shape))


@pytest.mark.parametrize("count", [3, 8])
def test_a_restored_buffer_continues_alike(reach: Task, count: int) -> None:
    buffer, restored = ReplayBuffer(5, reach), ReplayBuffer(5, reach)
    buffer.add(numbered(reach, 0, count))
    restored.load({name: array.copy() for name, array in buffer.arrays().items()})
    for one in (buffer, restored):
        one.add(numbered(reach, 100, 2))
    for name, array in buffer.arrays().items():
        np.testing.assert_array_equal(array, restored.arrays()[name], err_msg=name)
    first, second = (one.sample(50, np.random.default_rng(1)) for one in (buffer, restored))
    np.testing.assert_array_equal(first.reward, second.reward)


def test_arrays_are_no_copies_and_hold_only_what_was_added(reach: Task) -> None:
    buffer = ReplayBuffer(1_000, reach)
    buffer.add(numbered(reach, 0, 3))
    arrays = buffer.arrays()
    assert len(arrays["observation"]) == 3
    buffer.add(numbered(reach, 10, 1_000))
    assert arrays["reward"][0] != 0.0, "they are written before training continues"


@pytest.mark.parametrize(("added", "latest", "expected"), [(4, 2, {2, 3}), (7, 3, {4, 5, 6}), (7, 9, {2, 3, 4, 5, 6})])
def test_samples_may_be_of_the_latest(reach: Task, added: int, latest: int, expected: set[float]) -> None:
    buffer = ReplayBuffer(5, reach)
    buffer.add(numbered(reach, 0, added))
    assert {*buffer.sample(200, np.random.default_rng(0), latest).reward.tolist()} == expected


def test_a_buffer_shows_what_it_holds(reach: Task) -> None:
    buffer = ReplayBuffer(5, reach)
    for first, held in ((0, [0.0, 1.0, 2.0]), (3, [1.0, 2.0, 3.0, 4.0, 5.0])):
        buffer.add(numbered(reach, first, 3))
        assert sorted(buffer.held.reward.tolist()) == held


def test_transitions_follow_others(reach: Task) -> None:
    joined = numbered(reach, 3, 2).followed_by(numbered(reach, 8, 2))
    assert joined.reward.tolist() == joined.observation[:, 0].tolist() == [3.0, 4.0, 8.0, 9.0]
