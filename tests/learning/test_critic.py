"""Advantages and targets of a batch follow from its rewards when the value network puts out a constant."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch

from codesign_bench.learning.critic import Critic, Estimates
from codesign_bench.learning.trajectories import Trajectories
from codesign_bench.learning.two_phase import TwoPhaseLearner
from codesign_bench.learning.value_networks import ValueNetwork
from codesign_bench.task import Floats

MakeLearner = Callable[..., TwoPhaseLearner]
VALUE = 2.0


class Constant(ValueNetwork):
    """Expects the same return of every state."""

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        """Return `VALUE` for each row."""
        return torch.full((len(observation),), VALUE)

    def update_statistics(self, observation: torch.Tensor) -> None:
        """Keep no statistics."""


def estimated(learner: TwoPhaseLearner, batch: Trajectories) -> Estimates:
    """Return what the constant network makes of the batch under the learner's configuration."""
    critic = Critic(Constant(), learner.config, learner.compute)
    return critic.estimate(batch, torch.from_numpy(batch.observation[batch.valid]))


def by_hand(batch: Trajectories, bootstrap: bool, gamma: float, gae_lambda: float) -> Floats:
    """Return the (n,) advantages of the valid steps, slot by slot and backwards in time."""
    result: Floats = np.zeros(batch.valid.shape)
    for slot in range(len(result)):
        following = 0.0
        for step in range(int(batch.valid[slot].sum()) - 1, -1, -1):
            if batch.episode_end[slot, step]:
                following = 0.0
            nothing_follows = batch.terminated[slot, step] or (batch.truncated[slot, step] and not bootstrap)
            later = 0.0 if nothing_follows else gamma * VALUE
            following = batch.reward[slot, step] + later - VALUE + gamma * gae_lambda * following
            result[slot, step] = following
    return result[batch.valid]


@pytest.mark.parametrize("bootstrap", [True, False])
def test_advantages_by_hand(make_learner: MakeLearner, bootstrap: bool) -> None:
    learner = make_learner(bootstrap_time_limit=bootstrap, gamma=0.9, gae_lambda=0.8, normalize_returns=False)
    batch = learner.collect(120, 10)
    assert batch.truncated.any()
    assert batch.terminated.any()
    found, expected = estimated(learner, batch), by_hand(batch, bootstrap, 0.9, 0.8)
    np.testing.assert_allclose(found.advantage, expected, atol=1e-5)
    np.testing.assert_allclose(found.target, expected + VALUE, atol=1e-5)


def test_normalised_targets_have_mean_zero_and_deviation_one(make_learner: MakeLearner) -> None:
    learner = make_learner(normalize_returns=True)
    target = estimated(learner, learner.collect(120, 10)).target
    assert float(target.mean()) == pytest.approx(0.0, abs=1e-5)
    assert float(target.std(unbiased=False)) == pytest.approx(1.0, rel=1e-4)


def test_a_constant_explains_no_variance(make_learner: MakeLearner) -> None:
    learner = make_learner()
    assert estimated(learner, learner.collect(120, 10)).explained_variance == pytest.approx(0.0, abs=1e-6)
