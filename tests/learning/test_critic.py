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
from tolerances import of_sum

pytestmark = pytest.mark.numeric

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
    # Computed in double precision, then rounded once; a target once more, when it is divided by 1 + 5e-9.
    largest = np.abs(expected).max() + VALUE
    np.testing.assert_allclose(found.advantage, expected, rtol=0, atol=of_sum(1, largest))
    np.testing.assert_allclose(found.target, expected + VALUE, rtol=0, atol=of_sum(2, largest) + 5e-9 * largest)


def test_normalised_targets_have_mean_zero_and_deviation_one(make_learner: MakeLearner) -> None:
    learner = make_learner(normalize_returns=True)
    target = estimated(learner, learner.collect(120, 10)).target.double()
    # Each target is rounded once, and 1e-8 is added to the returns' variance, which is of order one.
    assert float(target.mean()) == pytest.approx(0.0, abs=of_sum(1))
    assert float(target.std(unbiased=False)) == pytest.approx(1.0, rel=of_sum(1) + 1e-8)


def test_a_constant_explains_no_variance(make_learner: MakeLearner) -> None:
    learner = make_learner()
    # In double precision; 1e-12 is added to the returns' variance.
    assert estimated(learner, learner.collect(120, 10)).explained_variance == pytest.approx(0.0, abs=1e-9)
