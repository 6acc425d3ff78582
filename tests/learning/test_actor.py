"""An actor explores by its Gaussians and reports the log-probabilities of what it did."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch

from codesign_bench.learning.actor import LOG_PROB, ActorPolicy, GaussianExplorer, gaussian_log_prob
from codesign_bench.learning.ppo import gaussian
from codesign_bench.learning.two_phase import TwoPhaseLearner
from tolerances import of_log_prob, of_network, of_sum

pytestmark = pytest.mark.numeric

MakeLearner = Callable[..., TwoPhaseLearner]


def test_stored_log_probabilities_are_those_of_the_stored_actions(make_learner: MakeLearner) -> None:
    learner = make_learner()
    batch = learner.collect(60, 4)
    for distribution, action, rows in (
        (learner.actor.design, batch.design, batch.valid & batch.is_design),
        (learner.actor.control, batch.control, batch.valid & ~batch.is_design),
    ):
        seen, acted = torch.from_numpy(batch.observation[rows]), torch.from_numpy(action[rows])
        with torch.no_grad():
            mean, log_std = distribution(seen)
            expected, _ = gaussian(mean, log_std, acted)
            away = float(((acted - mean) / log_std.exp()).abs().max())
        # The network, which sees normalised observations, had other rows beside it when the action was chosen; and the
        # action is a sum, which was rounded.
        error = of_network((seen.shape[1], 16, 16), 5.0) + of_sum(2, float(acted.abs().max()))
        tolerance = of_log_prob(acted.shape[1], away, float(log_std.exp().min()), error)
        np.testing.assert_allclose(batch.extras[LOG_PROB][rows], expected.numpy(), rtol=0, atol=tolerance)


def test_without_noise_the_explorer_does_what_the_policy_does(make_learner: MakeLearner) -> None:
    learner = make_learner()
    batch = learner.collect(60, 4)
    seen = batch.observation[batch.valid]
    explorer, policy = GaussianExplorer(learner.actor), ActorPolicy(learner.actor)
    slots = np.arange(len(seen))
    for sample, act, size in (
        (explorer.sample_design, policy.design, explorer.design_noise),
        (explorer.sample_control, policy.act, explorer.control_noise),
    ):
        quiet = np.zeros((len(seen), size), np.float32)
        np.testing.assert_array_equal(np.clip(sample(slots, seen, quiet).actions, -1.0, 1.0), act(seen))


def test_gaussian_log_probability_equals_torchs() -> None:
    noise, log_std = np.array([[0.5, -1.0], [0.0, 2.0]], np.float32), np.array([-0.5, 0.3], np.float32)
    normal = torch.distributions.Normal(torch.zeros(2), torch.from_numpy(np.exp(log_std)))
    expected = normal.log_prob(torch.from_numpy(noise * np.exp(log_std))).sum(1).numpy()
    # torch takes the noise back from the action, a product that was rounded, of numbers up to 2.7.
    tolerance = of_log_prob(2, 2.0, float(np.exp(-0.5)), of_sum(1, 2.7))
    np.testing.assert_allclose(gaussian_log_prob(noise, log_std), expected, rtol=0, atol=tolerance)
