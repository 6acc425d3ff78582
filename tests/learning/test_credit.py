"""Who is credited with an episode's outcome: which steps are learned, from which advantages, by which parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from codesign_bench.learning.credit import JointCredit, NoCredit, SeparateCredit, Steps
from codesign_bench.learning.explorer import Explorer, FixedDesigns, Trial
from codesign_bench.learning.ppo import gaussian
from codesign_bench.learning.ppo_method import PPOMethod
from codesign_bench.learning.trajectories import Trajectories
from codesign_bench.learning.two_phase import TwoPhaseLearner
from codesign_bench.method import Problem, load_method, method_names
from codesign_bench.seeding import Streams
from codesign_bench.task import Floats, Task
from tolerances import of_log_prob, of_network, of_sum

pytestmark = pytest.mark.numeric

MakeLearner = Callable[..., TwoPhaseLearner]
BUDGET = 10_000


def middle(explorer: Explorer, steps: int, slots: int) -> tuple[Explorer, int]:
    """Give every slot the middle of the design space."""
    return FixedDesigns(explorer, Trial(np.zeros((slots, 1), np.float32))), slots


def assert_normalized_alike(found: torch.Tensor, values: Floats) -> None:
    """Assert that numbers are `values` (n,) with mean 0 and deviation 1, as far as single precision allows."""
    expected = (values - values.mean()) / (values.std() + 1e-8)
    tolerance = of_sum(len(values) + 4, np.abs(values).max() / values.std())
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


def estimated(learner: TwoPhaseLearner, batch: Trajectories) -> Floats:
    """Return the advantages (n,) of a batch, of a learner that keeps no statistics of returns."""
    assert not learner.config.normalize_returns
    return learner.critic.estimate(batch, torch.from_numpy(batch.observation[batch.valid])).advantage.double().numpy()


def make_constant(network: torch.nn.Module, value: float) -> None:
    """Let a perceptron value network put out `value`, whatever it sees."""
    layers: Any = network.mlp
    with torch.no_grad():
        layers[-1].weight.zero_()
        layers[-1].bias.fill_(value)


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({"design_credit": "joint"}, JointCredit),
        ({"design_credit": "separate"}, SeparateCredit),
        ({"design_credit": "separate", "give_designs": middle}, NoCredit),
        ({"design_credit": "joint", "give_designs": middle}, NoCredit),
    ],
)
def test_the_configuration_chooses_the_credit(
    make_learner: MakeLearner, settings: dict[str, Any], expected: type
) -> None:
    assert type(make_learner(**settings).credit) is expected


def test_joint_credit_trains_shared_parameters_once(make_learner: MakeLearner) -> None:
    learner = make_learner(design_credit="joint")
    (group,) = learner.optimizers["policy"].param_groups
    learned = [parameter for parameter in learner.actor.parameters() if parameter.requires_grad]
    assert {id(parameter) for parameter in group["params"]} == {id(parameter) for parameter in learned}
    assert len(group["params"]) == len(learned)


def test_joint_credit_learns_design_and_control_steps_in_the_same_minibatches(
    make_learner: MakeLearner, recorder: Any
) -> None:
    learner = make_learner(design_credit="joint", epochs=1, normalize_returns=False, loop=recorder)
    batch = learner.collect(60, 10)
    advantage = estimated(learner, batch)
    learner.update(batch)
    (policy,) = recorder.policies
    assert sorted(recorder.rows(policy)) == list(range(batch.env_steps))
    assert_normalized_alike(policy.advantage, advantage)


def test_separate_credit_leaves_design_steps_to_their_own_update(make_learner: MakeLearner, recorder: Any) -> None:
    settings = {"design_credit": "separate", "epochs": 1, "design_epochs": 1, "normalize_returns": False}
    learner = make_learner(**settings, loop=recorder)
    batch = learner.collect(60, 10)
    advantage = estimated(learner, batch)
    learner.update(batch)
    control, design = recorder.policies
    is_design = batch.is_design[batch.valid]
    assert sorted(recorder.rows(control)) == np.flatnonzero(~is_design).tolist()
    assert_normalized_alike(control.advantage[~is_design], advantage[~is_design])
    assert sorted(recorder.rows(design)) == list(range(int(is_design.sum())))


def test_separate_credit_gives_a_design_its_undiscounted_return(make_learner: MakeLearner, recorder: Any) -> None:
    learner = make_learner(design_credit="separate", gamma=0.5, design_epochs=1, loop=recorder)
    make_constant(learner.credit.modules["design_value"], 0.0)
    _, batch = learner.train(BUDGET)
    episodes = np.cumsum(batch.is_design[batch.valid]) - 1  # The episode that each valid step belongs to.
    returns = np.bincount(episodes, batch.reward[batch.valid])
    assert_normalized_alike(recorder.policies[1].advantage, returns)


@pytest.mark.parametrize("name", [name for name in method_names() if issubclass(load_method(name), PPOMethod)])
def test_a_control_update_alone_never_stops_the_design_update(name: str, reach: Task) -> None:
    method_class: Any = load_method(name)
    steps_of_designs = {**method_class.small(), "design_epochs": 3, "design_minibatch_size": 20}
    # Control steps go as far as they like; design steps have no length, so all that moves the designer is the trunk.
    settings = {"design_credit": "separate", "policy_learning_rate": 0.1, "kl_threshold": 1e9}
    settings |= {"design_learning_rate": 0.0, "design_kl_threshold": 1e-6}
    config = replace(method_class.config_class(), **(steps_of_designs | settings))
    method = method_class(Problem(reach), config, Streams(0))
    report = method.train(BUDGET)
    assert report.metrics["kl"] > 1e3 * config.design_kl_threshold
    assert report.metrics["design_steps"] >= config.design_epochs
    assert report.metrics["design_kl"] < config.design_kl_threshold


def test_designs_that_are_given_are_not_learned(make_learner: MakeLearner, recorder: Any) -> None:
    learner = make_learner(fix_std=False, give_designs=middle, loop=recorder)
    head = {name: tensor.clone() for name, tensor in learner.actor.named_parameters() if "design" in name}
    _, batch = learner.train(BUDGET)
    for name, tensor in learner.actor.named_parameters():
        if "design" in name:
            assert torch.equal(tensor, head[name]), name
    (policy,) = recorder.policies
    assert not batch.is_design[batch.valid][recorder.rows(policy)].any()


def test_joint_log_probabilities_are_each_phases_own_in_the_rows_order(make_learner: MakeLearner) -> None:
    learner = make_learner(design_credit="joint")
    steps = Steps.of(learner.collect(60, 10), learner.compute)
    rows = np.random.default_rng(0).permutation(len(steps.observation))[:25]
    # A row alone and many may be multiplied in another order.
    error = of_network((steps.observation.shape[1], 16, 16), 5.0)
    with torch.no_grad():
        found, entropy = learner.credit.log_probs(steps)(rows)
        share = 0.0
        for row, log_prob in zip(rows, found, strict=True):
            designing, seen = bool(steps.is_design[row]), steps.observation[row, None]
            phase, action = (
                (learner.actor.design, steps.design) if designing else (learner.actor.control, steps.control)
            )
            mean, log_std = phase(seen)
            expected, part = gaussian(mean, log_std, action[row, None])
            away = float(((action[row] - mean) / log_std.exp()).abs().max())
            tolerance = of_log_prob(action.shape[1], away, float(log_std.exp().min()), error)
            assert float(log_prob) == pytest.approx(float(expected), rel=0, abs=tolerance)
            share += float(part) / len(rows)
    assert 0 < steps.is_design[rows].sum() < len(rows)
    assert float(entropy) == pytest.approx(share, rel=of_sum(4))  # Two shares, two products and a sum.


def test_a_minibatch_without_a_design_step_is_learned_from(make_learner: MakeLearner) -> None:
    learner = make_learner(design_credit="joint", minibatch_size=2, epochs=1)  # One step in six is a design step.
    report, _ = learner.train(BUDGET)
    assert report.metrics["policy_steps"] > 1
    assert all(torch.isfinite(parameter).all() for parameter in learner.actor.parameters())
