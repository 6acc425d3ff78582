"""Who is credited with an episode's outcome: which steps are learned, from which advantages, by which parameters."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch

from codesign_bench.learning.credit import JointCredit, NoCredit, SeparateCredit, Steps
from codesign_bench.learning.ppo import gaussian
from codesign_bench.learning.two_phase import TwoPhaseLearner
from codesign_bench.task import Floats, Singles, Slots

MakeLearner = Callable[..., TwoPhaseLearner]
BUDGET = 10_000


def middle(slots: Slots) -> Singles:
    """Choose the middle of the design space for every slot (b,)."""
    return np.zeros((len(slots), 1), np.float32)


def normalized(values: Floats) -> Floats:
    """Return values with mean 0 and deviation 1."""
    return (values - values.mean()) / (values.std() + 1e-8)


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
        ({"design_credit": "separate", "choose_designs": middle}, NoCredit),
        ({"design_credit": "joint", "choose_designs": middle}, NoCredit),
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
    _, batch = learner.train(BUDGET)
    (policy,) = recorder.policies
    assert sorted(recorder.rows(policy)) == list(range(batch.env_steps))
    assert float(policy.advantage.mean()) == pytest.approx(0.0, abs=1e-5)
    assert float(policy.advantage.std(unbiased=False)) == pytest.approx(1.0, rel=1e-4)


def test_separate_credit_leaves_design_steps_to_their_own_update(make_learner: MakeLearner, recorder: Any) -> None:
    learner = make_learner(design_credit="separate", epochs=1, design_epochs=1, loop=recorder)
    _, batch = learner.train(BUDGET)
    control, design = recorder.policies
    is_design = batch.is_design[batch.valid]
    assert sorted(recorder.rows(control)) == np.flatnonzero(~is_design).tolist()
    assert float(control.advantage[~torch.from_numpy(is_design)].mean()) == pytest.approx(0.0, abs=1e-5)
    assert sorted(recorder.rows(design)) == list(range(int(is_design.sum())))


def test_separate_credit_gives_a_design_its_undiscounted_return(make_learner: MakeLearner, recorder: Any) -> None:
    learner = make_learner(design_credit="separate", gamma=0.5, design_epochs=1, loop=recorder)
    make_constant(learner.credit.modules["design_value"], 0.0)
    _, batch = learner.train(BUDGET)
    episodes = np.cumsum(batch.is_design[batch.valid]) - 1  # The episode that each valid step belongs to.
    returns = np.bincount(episodes, batch.reward[batch.valid])
    np.testing.assert_allclose(recorder.policies[1].advantage, normalized(returns), atol=1e-4)


def test_designs_that_are_given_are_not_learned(make_learner: MakeLearner, recorder: Any) -> None:
    learner = make_learner(fix_std=False, choose_designs=middle, loop=recorder)
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
    with torch.no_grad():
        found, entropy = learner.credit.log_probs(steps)(rows)
        share = 0.0
        for row, log_prob in zip(rows, found, strict=True):
            designing, seen = bool(steps.is_design[row]), steps.observation[row, None]
            phase, action = (
                (learner.actor.design, steps.design) if designing else (learner.actor.control, steps.control)
            )
            expected, part = gaussian(*phase(seen), action[row, None])
            torch.testing.assert_close(log_prob, expected[0])
            share += float(part) / len(rows)
    assert 0 < steps.is_design[rows].sum() < len(rows)
    assert float(entropy) == pytest.approx(share, rel=1e-5)


def test_a_minibatch_without_a_design_step_is_learned_from(make_learner: MakeLearner) -> None:
    learner = make_learner(design_credit="joint", minibatch_size=2, epochs=1)  # One step in six is a design step.
    report, _ = learner.train(BUDGET)
    assert report.metrics["policy_steps"] > 1
    assert all(torch.isfinite(parameter).all() for parameter in learner.actor.parameters())
