"""A designer that leads: what it assumes of the controller, and what becomes of its gradient.

Shapes: `m` episodes, `s` control steps of each, `P` parameters of the designer, `Q` parameters of the controller.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
import torch
from torch import Tensor

from codesign_bench.learning.credit import Steps
from codesign_bench.learning.implicit_gradient import Response, hessian_product
from codesign_bench.learning.ppo import PolicyLoss, gaussian
from codesign_bench.learning.stackelberg import (
    Follower,
    LeaderUpdate,
    StackelbergConfig,
    StackelbergCredit,
    StackelbergLearner,
    control_steps,
    divergence,
)
from codesign_bench.method import Problem, load_method
from codesign_bench.seeding import Streams
from codesign_bench.task import Slots, Task
from double_precision import compute_in_double

pytestmark = pytest.mark.numeric
EXACT = {"cg_iterations": 200, "cg_tolerance": 1e-13}


def make_learner(task: Task, **changes: Any) -> StackelbergLearner:
    """Return a small learner on a task."""
    method_class: Any = load_method("stackelberg_ppo")
    small = {**method_class.small(), "batch_size": 60, **changes}
    config = replace(method_class.config_class(), **small)
    method = method_class(Problem(task), config, Streams(0))
    return cast(StackelbergLearner, method.learner)


def test_control_steps_are_those_between_design_steps() -> None:
    found = control_steps(np.array([True, False, False, True, False, True, False, False, False]))
    assert [rows.tolist() for rows in found] == [[1, 2], [4], [6, 7, 8]]


def test_gradient_steps_go_through_the_control_steps_and_begin_again(reach: Task) -> None:
    learner = make_learner(reach, response_steps=2)
    steps = Steps.of(learner.collect(60, 10), learner.compute)
    follower = Follower(
        learner.config, learner.actor, steps, torch.zeros(len(steps.control)), learner.compute, np.random.default_rng(0)
    )
    own = control_steps(steps.designing)
    episodes = np.array([3, 0])
    turns = [follower.rows(episodes, turn) for turn in range(5)]
    for place, episode in enumerate(episodes):
        used = np.concatenate([rows[place] for rows in turns])
        whole = len(own[episode])
        assert sorted(used[:whole]) == own[episode].tolist()
        np.testing.assert_array_equal(used[whole:], used[: len(used) - whole])


def test_the_curvature_is_the_fisher_information() -> None:
    # The mean of a control is w o, its deviation exp(l): the information of w is the mean of o^2 / exp(2 l), that of l
    # is 2, and they do not mix.
    seen = torch.tensor([[1.0], [2.0], [3.0]], dtype=torch.float64)
    weight = torch.tensor([0.3], dtype=torch.float64, requires_grad=True)
    log_std = torch.tensor([-0.5], dtype=torch.float64, requires_grad=True)
    loss = divergence(seen * weight, log_std)
    assert float(loss.detach()) == 0.0
    product = hessian_product(loss, [weight, log_std])
    first, second = (product(torch.tensor(one, dtype=torch.float64)) for one in ([1.0, 0.0], [0.0, 1.0]))
    np.testing.assert_allclose(first, [14.0 / 3.0 * np.e, 0.0], atol=1e-12)
    np.testing.assert_allclose(second, [0.0, 2.0], atol=1e-12)


def flat(parameters: list[Any]) -> Tensor:
    """Return all parameters as one vector."""
    return torch.cat([parameter.detach().flatten() for parameter in parameters])


def gradient(value: Tensor, parameters: list[Any], retain_graph: bool | None = None) -> Tensor:
    """Return the gradient of a value in all parameters as one vector."""
    found = torch.autograd.grad(value, parameters, retain_graph=retain_graph, materialize_grads=True)
    return torch.cat([one.flatten() for one in found])


def shift(parameters: list[Any], change: Tensor) -> None:
    """Add to the parameters their parts of one vector."""
    with torch.no_grad():
        for parameter, part in zip(parameters, change.split([p.numel() for p in parameters]), strict=True):
            parameter.add_(part.view_as(parameter))


def fisher_matrix(follower: Follower, observation: Tensor) -> Tensor:
    """Return the mean of J' S^-1 J over observations, J the slopes of the mean, and 2 for a log deviation."""
    mean, log_std = follower.actor.control(observation)
    size = sum(parameter.numel() for parameter in follower.parameters)
    fisher = torch.zeros(size, size, dtype=torch.float64)
    for row in range(len(observation)):
        for entry in range(mean.shape[1]):
            slope = gradient(mean[row, entry], follower.parameters, retain_graph=True)
            fisher += torch.outer(slope, slope) / log_std[entry].detach().exp() ** 2 / len(observation)
    deviation = follower.actor.control_log_std
    of_std = torch.cat([torch.full((p.numel(),), float(p is deviation)) for p in follower.parameters])
    return fisher + 2.0 * torch.diag(of_std.double())


def test_the_response_is_that_to_a_damped_natural_step_of_the_controller(
    reach: Task, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside an explicit Fisher matrix, and finite differences in the designer's parameters."""
    learner = make_learner(reach, response_steps=3, response_damping=0.7, fix_std=False, **EXACT)
    batch = learner.collect(60, 10)
    compute_in_double(monkeypatch, learner)
    actor, config = learner.actor, learner.config
    steps = Steps.of(batch, learner.compute)
    advantage = torch.from_numpy(np.random.default_rng(1).normal(size=len(steps.control)))
    follower = Follower(config, actor, steps, advantage, learner.compute, np.random.default_rng(2))
    episodes, leader = np.arange(6), [p for p in actor.design_parameters() if p.requires_grad]
    designs = torch.from_numpy(np.flatnonzero(steps.designing)[episodes])
    rows = torch.from_numpy(follower.rows(episodes, 1).ravel())

    def ratio() -> Tensor:
        log_prob, _ = gaussian(*actor.design(steps.observation[designs]), steps.design[designs])
        return (log_prob - steps.log_prob[designs]).exp()

    def control_log_prob() -> Tensor:
        return gaussian(*actor.control(steps.observation[rows]), steps.control[rows])[0]

    damped = fisher_matrix(follower, steps.observation[rows])
    damped += 0.7 * torch.eye(len(damped))

    # What the controller's parameters are worth to the designer: the slope of the clipped surrogate loss.
    controls, old = control_log_prob(), steps.log_prob[rows]
    worth = gradient(learner_loss(config)(controls, old, advantage[rows], torch.zeros(()))[0], follower.parameters)

    def moved() -> Tensor:
        """Return where the controller's parameters go when each episode counts by the ratio of its design."""
        gains = ((control_log_prob() - old).exp() * advantage[rows]).view(6, 3).mean(1)
        push = gradient((ratio().detach() * gains).mean(), follower.parameters)
        return flat(follower.parameters) + torch.linalg.solve(damped, push)

    found = follower.response(ratio(), episodes, 1, leader).gradient
    for seed in range(3):
        way = torch.from_numpy(np.random.default_rng(seed).normal(size=len(found)))
        ends = []
        for sign in (1.0, -2.0):  # a step forth, and two back
            shift(leader, sign * 1e-6 * way)
            ends.append(worth @ moved())
        shift(leader, 1e-6 * way)
        # The leader's loss after the controller has moved falls where the response term rises.
        assert float((ends[0] - ends[1]) / 2e-6) == pytest.approx(-float(found @ way), rel=1e-5)
    assert found.norm() > 1e-4


def learner_loss(config: StackelbergConfig) -> PolicyLoss:
    """Return the controller's loss."""
    return PolicyLoss.of(config, config.kl_threshold)


class OneWay:
    """A follower whose response is the same whatever is asked."""

    def __init__(self, gradient: list[float], limit: float) -> None:
        self.gradient, self.config = torch.tensor(gradient), StackelbergConfig(response_limit=limit)

    def response(self, ratio: Tensor, episodes: Slots, turn: int, leader: list[Tensor]) -> Response:
        """Return it."""
        return Response(self.gradient, 7)


@pytest.mark.parametrize(
    ("response", "limit", "moved"),
    [
        ([0.0, 1.0], 1.0, (-3.0, -3.0)),  # Short enough: the gradient (3, 4) less (0, 1).
        ([0.0, 10.0], 1.0, (-3.0, 1.0)),  # Twice as long as the direct gradient: half of it is subtracted.
        ([0.0, 10.0], 0.5, (-3.0, -1.5)),
        ([0.0, 10.0], 0.0, (-3.0, -4.0)),  # Switched off.
        ([0.0, 0.0], 1.0, (-3.0, -4.0)),
    ],
)
def test_the_response_term_is_subtracted_and_limited(
    response: list[float], limit: float, moved: tuple[float, float]
) -> None:
    parameter = torch.nn.Parameter(torch.zeros(2))
    follower = cast(Follower, OneWay(response, limit))
    loss = PolicyLoss(clip_ratio=0.2, entropy_weight=0.0, kl_threshold=1.0, max_gradient_norm=100.0)
    # One design with advantage 1 and log-probability (-3, -4) times the parameters: the loss has the slope (3, 4).
    update = LeaderUpdate(
        loss,
        lambda rows: ((parameter @ torch.tensor([-3.0, -4.0]))[None], torch.zeros(())),
        torch.optim.SGD([parameter], lr=1.0),
        torch.zeros(1),
        torch.ones(1),
        follower=follower,
    )
    update.step(np.zeros(1, dtype=np.intp))
    assert parameter.tolist() == pytest.approx(moved)
    assert update.logged["response_ratio"] == pytest.approx(np.linalg.norm(response) / 5.0)
    assert update.logged["response_cosine"] == pytest.approx(0.8 if any(response) else 0.0)
    assert update.logged["cg_iterations"] == 7.0


def test_the_designer_is_updated_before_the_controller_and_once(reach: Task) -> None:
    learner = make_learner(reach)
    assert isinstance(learner.credit, StackelbergCredit)
    batch = learner.collect(60, 10)
    steps = Steps.of(batch, learner.compute)
    designer, controller = (
        flat(list(p)) for p in (learner.actor.design_parameters(), learner.actor.control_parameters())
    )
    advantage = torch.from_numpy(np.random.default_rng(1).normal(size=len(steps.control)).astype(np.float32))
    logged = learner.credit.lead(batch, steps, advantage)
    assert {"response_ratio", "response_cosine", "cg_iterations", "design_kl"} <= logged.keys()
    assert not torch.equal(flat(learner.actor.design_parameters()), designer)
    assert torch.equal(flat(learner.actor.control_parameters()), controller)
    assert all(parameter.grad is None for parameter in learner.actor.control_parameters())
    assert learner.credit.learn(batch) == {}
