"""What follows from a batch of trajectories, by hand numbers. Shapes: `S` slots, `T` steps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from codesign_bench.learning.trajectories import Trajectories, joined
from codesign_bench.learning.two_phase import TwoPhaseLearner

MakeLearner = Callable[..., TwoPhaseLearner]


@pytest.fixture
def by_hand() -> Trajectories:
    """One slot: an episode that is solved in its second control step, then one that is cut off after its first."""
    batch = Trajectories.empty(slots=1, steps=6, observation=1, control=1, design=1)
    batch.observation[0, :, 0] = (1.0, 2.0, 3.0, 4.0, 5.0, 0.0)
    batch.final_observation[0, 4, 0] = 6.0
    batch.reward[0] = (0.0, 0.5, 1.0, 0.0, -0.5, 0.0)
    batch.is_design[0, [0, 3]] = True
    batch.terminated[0, 2] = batch.success[0, 2] = batch.truncated[0, 4] = True
    batch.valid[0, :5] = True
    batch.reward_terms.update(progress=-1.0, bonus=2.0)
    return batch


def test_summary(by_hand: Trajectories) -> None:
    assert by_hand.summary() == {
        "train_return": 0.5,
        "train_success": 0.5,
        "train_episode_length": 1.5,
        "reward_progress": -0.5,
        "reward_bonus": 1.0,
    }


def test_the_next_observation_stays_within_the_episode(by_hand: Trajectories) -> None:
    going_on = by_hand.valid & ~by_hand.terminated
    np.testing.assert_array_equal(by_hand.next_observation[going_on][:, 0], [2.0, 3.0, 5.0, 6.0])


def test_the_next_observations_of_a_rollout_are_what_the_next_steps_saw(make_learner: MakeLearner) -> None:
    batch = make_learner().collect(60, 4)
    following = batch.next_observation
    for slot, step in zip(*np.nonzero(batch.valid & ~batch.terminated), strict=True):
        seen = batch.final_observation if batch.truncated[slot, step] else np.roll(batch.observation, -1, axis=1)
        np.testing.assert_array_equal(following[slot, step], seen[slot, step])


def test_joined_groups_keep_their_slots_in_order_and_pad_with_steps_that_are_not_valid(
    make_learner: MakeLearner,
) -> None:
    learner = make_learner()
    short, long = learner.collect(20, 2), learner.collect(60, 3)
    for group, progress in ((short, 1.0), (long, 2.0)):
        group.reward_terms.clear()
        group.reward_terms["progress"] = progress
    batch = joined([short, long])
    assert batch.env_steps == short.env_steps + long.env_steps
    assert batch.valid[:, -1].any(), "a batch is as long as its longest slot"
    assert not batch.valid[:2, short.valid.shape[1] :].any()
    assert batch.reward_terms == {"progress": 3.0}
    for name, values in {**arrays(batch), **batch.extras}.items():
        for group, slots in ((short, slice(0, 2)), (long, slice(2, 5))):
            own = {**arrays(group), **group.extras}[name]
            played = int(group.valid.sum(axis=1).max())
            np.testing.assert_array_equal(values[slots, :played], own[:, :played], err_msg=name)


def arrays(batch: Trajectories) -> dict[str, np.ndarray]:
    """Return the arrays that every batch has, by name."""
    return {name: values for name, values in vars(batch).items() if isinstance(values, np.ndarray)}
