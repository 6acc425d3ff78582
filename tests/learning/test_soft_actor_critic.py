"""Soft actor-critic: densities beside torch's, losses by hand, and a problem of one step whose answer is known.

Shapes: `m` transitions of a minibatch, `O` observation, `C` control.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import Tensor
from torch.distributions import Independent, Normal, TanhTransform, TransformedDistribution

from codesign_bench.learning.replay import Transitions
from codesign_bench.learning.soft_actor_critic import (
    SoftActorCritic,
    SoftActorCriticConfig,
    SquashedExplorer,
    TwinCritic,
)
from codesign_bench.task import Task

pytestmark = pytest.mark.numeric

SMALL = SoftActorCriticConfig(hidden=(16, 16), minibatch_size=32)


def make(task: Task, seed: int = 0, **changes: object) -> SoftActorCritic:
    """Return a small learner."""
    config = replace(SMALL, **changes)  # type: ignore[arg-type]  # by name
    return SoftActorCritic(task, config, np.random.default_rng(seed), np.random.default_rng(seed + 100))


def control_steps(task: Task, count: int, seed: int = 0) -> Transitions:
    """Return control steps from anywhere to anywhere, without reward."""
    rng, steps = np.random.default_rng(seed), Transitions.empty(count, task)
    for array in (steps.observation, steps.next_observation):
        array[:] = rng.uniform(-1.0, 1.0, array.shape)
    steps.control[:] = rng.uniform(-1.0, 1.0, steps.control.shape)
    return steps


def tensors(steps: Transitions) -> dict[str, Tensor]:
    """Return the arrays of transitions as tensors."""
    return {name: torch.from_numpy(array) for name, array in vars(steps).items()}


def make_constant(critic: TwinCritic, first: float, second: float) -> None:
    """Let twin critics put out these numbers, whatever they see."""
    with torch.no_grad():
        critic.networks.weights[-1].zero_()
        critic.networks.biases[-1].copy_(torch.tensor([first, second]).view(2, 1, 1))


def test_log_probabilities_are_those_of_a_squashed_gaussian(reach: Task) -> None:
    actor = make(reach).actor
    seen = torch.from_numpy(control_steps(reach, 50).observation)
    noise = torch.from_numpy(np.random.default_rng(1).standard_normal((50, actor.size), dtype=np.float32))
    with torch.no_grad():
        control, log_prob = actor.sample(seen, noise)
        mean, log_std = actor(seen)
        density = TransformedDistribution(Independent(Normal(mean, log_std.exp()), 1), [TanhTransform(cache_size=1)])
        expected = density.log_prob(torch.tanh(mean + log_std.exp() * noise).clamp(-1 + 1e-6, 1 - 1e-6))
    assert (control.abs() < 1.0).all()
    np.testing.assert_allclose(log_prob, expected, atol=1e-3)


def test_a_control_at_the_bound_has_a_finite_log_probability(reach: Task) -> None:
    actor = make(reach).actor
    with torch.no_grad():  # of the output layer: mean 50, standard deviation exp(0)
        actor.mlp[-1].weight.zero_()  # type: ignore[operator]  # a linear layer
        actor.mlp[-1].bias[: actor.size] = 50.0  # type: ignore[index,operator]  # likewise
    control, log_prob = actor.sample(torch.zeros(1, reach.layout.size), torch.zeros(1, actor.size))
    assert control.tolist() == [[1.0] * actor.size]
    # log(1 - tanh(50)^2) = log 4 - 100, to all digits.
    expected = actor.size * (-0.5 * np.log(2.0 * np.pi) - np.log(4.0) + 100.0)
    assert log_prob.item() == pytest.approx(expected, rel=1e-4)
    log_prob.sum().backward()
    assert all(parameter.grad is not None and parameter.grad.isfinite().all() for parameter in actor.parameters())


def test_the_critics_learn_from_the_smaller_target_and_only_where_the_episode_goes_on(reach: Task) -> None:
    learner, steps = make(reach, temperature=0.0, gamma=0.5), control_steps(reach, 2)
    make_constant(learner.critic, 1.0, 2.0)
    make_constant(learner.target, 6.0, 4.0)
    steps.reward[:], steps.terminated[:] = (3.0, 10.0), (False, True)
    # Targets: 3 + 0.5 * 4 = 5, and 10, after which there is nothing.
    expected = 0.5 * ((1 - 5) ** 2 + (1 - 10) ** 2) + 0.5 * ((2 - 5) ** 2 + (2 - 10) ** 2)
    found = learner.critic_loss(tensors(steps), torch.zeros(2, learner.actor.size))
    assert float(found.detach()) == pytest.approx(expected)


def test_the_next_state_is_worth_its_entropy_too(reach: Task) -> None:
    learner, steps = make(reach, temperature=0.3, gamma=0.5), control_steps(reach, 1)
    make_constant(learner.critic, 0.0, 0.0)
    make_constant(learner.target, 4.0, 4.0)
    noise = torch.full((1, learner.actor.size), 0.4)
    log_prob = float(learner.actor.sample(torch.from_numpy(steps.next_observation), noise)[1].detach())
    found = learner.critic_loss(tensors(steps), noise)
    assert float(found.detach()) == pytest.approx(2.0 * (0.5 * (4.0 - 0.3 * log_prob)) ** 2)


def test_an_update_moves_all_networks_and_targets_slowly(reach: Task) -> None:
    learner = make(reach, target_rate=0.1)
    before = {name: [p.detach().clone() for p in network.parameters()] for name, network in learner.modules.items()}
    learner.update(control_steps(reach, 32), np.random.default_rng(0))
    for name in ("actor", "critic"):
        assert any(not torch.equal(a, b) for a, b in zip(before[name], learner.modules[name].parameters(), strict=True))
    moved = zip(before["target"], learner.critic.parameters(), learner.target.parameters(), strict=True)
    for slow, fast, found in moved:
        np.testing.assert_allclose(found.detach(), 0.9 * slow + 0.1 * fast.detach(), rtol=1e-5, atol=1e-7)


def test_no_entry_of_a_gradient_is_larger_than_one(reach: Task) -> None:
    learner, steps = make(reach), control_steps(reach, 32)
    steps.reward[:] = 1e6
    learner.optimizers["critic"] = torch.optim.SGD(learner.critic.parameters(), lr=1.0)
    before = [parameter.detach().clone() for parameter in learner.critic.parameters()]
    learner.update(steps, np.random.default_rng(0))
    moved = [(p.detach() - old).abs().max() for p, old in zip(learner.critic.parameters(), before, strict=True)]
    assert max(moved) == pytest.approx(1.0, rel=1e-5)


def test_a_learner_starts_from_another_and_then_goes_its_own_way(reach: Task) -> None:
    old, new = make(reach, 1), make(reach, 2)
    for learner in (old, new):
        learner.update(control_steps(reach, 32), np.random.default_rng(0))
    new.start_from(old)
    for name, network in new.modules.items():
        for key, tensor in network.state_dict().items():
            assert torch.equal(tensor, old.modules[name].state_dict()[key])
    assert not any(optimizer.state_dict()["state"] for optimizer in new.optimizers.values())
    kept = {key: tensor.clone() for key, tensor in old.critic.state_dict().items()}
    new.update(control_steps(reach, 32), np.random.default_rng(0))
    assert all(torch.equal(tensor, kept[key]) for key, tensor in old.critic.state_dict().items())


def test_it_finds_the_best_control_of_a_single_step(reach: Task) -> None:
    """The reward is highest at a control of half the design, and the episode ends."""
    learner, steps, rng = make(reach, learning_rate=1e-2), control_steps(reach, 2_000), np.random.default_rng(0)
    best = 0.5 * steps.observation[:, reach.layout.design][:, :1]
    steps.reward[:] = -((steps.control - best) ** 2).sum(axis=1)
    steps.terminated[:] = True
    for _ in range(400):
        learner.update(steps.rows(rng.integers(len(steps), size=64)), rng)
    with torch.no_grad():
        found = learner.actor.control(torch.from_numpy(steps.observation[:200])).numpy()
    assert np.abs(found - best[:200]).mean() < 0.1
    assert np.abs(best).mean() > 0.2  # what an actor that stays at zero would miss by


def test_an_explorer_samples_the_actor(reach: Task) -> None:
    learner = make(reach)
    seen = control_steps(reach, 5).observation
    noise = np.random.default_rng(0).standard_normal((5, learner.actor.size), dtype=np.float32)
    sample = SquashedExplorer(learner.actor).sample_control(np.arange(5), seen, noise)
    expected, _ = learner.actor.sample(torch.from_numpy(seen), torch.from_numpy(noise))
    np.testing.assert_array_equal(sample.actions, expected.detach().numpy())
    assert not sample.extras
