"""The designer as leader of a Stackelberg game: its gradient anticipates the controller's next update.

Shapes: `n` valid steps of a batch, `d` its design steps, `m` episodes of a minibatch of design steps, `s` control steps
of an episode, `D` design, `C` control, `O` observation.

The direct gradient of a design's return takes the controller as fixed. But the controller adapts to the designs that it
gets, so that a design may be worth more than it has earned so far. The response term adds this.
Source: Stackelberg PPO (Dai, Wang, Ashley, Schmidhuber; ICLR 2026, 2603.15388) and its code; what differs is on the
method's page.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Any, Literal

import numpy as np
import torch
from torch import Tensor
from torch.distributions import Normal, kl_divergence

from codesign_bench.config.search import Integer, LogUniform
from codesign_bench.config.values import Share, Within
from codesign_bench.learning.actor import Actor
from codesign_bench.learning.compute import Compute
from codesign_bench.learning.credit import DesignCredit, SeparateCredit, Steps
from codesign_bench.learning.implicit_gradient import Response, flat_gradient, hessian_product, response_term
from codesign_bench.learning.ppo import PolicyLoss, PolicyUpdate, clipped_step, gaussian
from codesign_bench.learning.ppo_config import PPOConfig
from codesign_bench.learning.trajectories import Trajectories
from codesign_bench.learning.two_phase import TwoPhaseLearner
from codesign_bench.task import Booleans, Slots


@dataclass(frozen=True, kw_only=True)
class StackelbergConfig(PPOConfig):
    """Hyperparameters of PPO with a designer that leads."""

    design_credit: Literal["separate"] = "separate"
    """Credit of the design step: the leader has an update of its own."""
    response_limit: Annotated[float, Within(0.0, 1_000.0)] = field(
        default=1.0, metadata={"search": LogUniform(0.1, 3.0)}
    )
    """Largest norm of the response term, as a multiple of the direct gradient's; 0 switches the response off."""
    response_damping: Annotated[float, Within(1e-6, 1e6)] = field(
        default=5.0, metadata={"search": LogUniform(0.1, 100.0)}
    )
    """What is added to the Fisher information of the controller; larger, a more cautious response."""
    response_steps: Annotated[int, Within(1, 1_000)] = field(default=6, metadata={"search": Integer(3, 24, log=True)})
    """Control steps of each episode from which a gradient step estimates the response."""
    cg_iterations: Annotated[int, Within(1, 1_000)] = 20
    """Most steps of conjugate gradients in a gradient step."""
    cg_tolerance: Share = 1e-3
    """Relative residual at which conjugate gradients end."""


class Follower:
    """The controller as the designer sees it: how its next update would follow a change of the designs."""

    def __init__(
        self,
        config: StackelbergConfig,
        actor: Actor,
        steps: Steps,
        advantage: Tensor,
        compute: Compute,
        rng: np.random.Generator,
    ) -> None:
        self.config, self.actor, self.steps, self.advantage, self.compute = config, actor, steps, advantage, compute
        self.parameters = [parameter for parameter in actor.control_parameters() if parameter.requires_grad]
        self.loss = PolicyLoss.of(config, config.kl_threshold)
        self.orders = [rng.permutation(rows) for rows in control_steps(steps.designing)]
        """Of each episode, the rows of its control steps in the order in which they are used."""

    def rows(self, episodes: Slots, turn: int) -> Slots:
        """Return the control steps (m, s) of `episodes` (m,) that the gradient step number `turn` uses."""
        # Each gradient step takes the next few; an episode that has no more begins again.
        places = range(turn * self.config.response_steps, (turn + 1) * self.config.response_steps)
        return np.stack([self.orders[episode].take(places, mode="wrap") for episode in episodes])

    def response(self, ratio: Tensor, episodes: Slots, turn: int, leader: Sequence[Tensor]) -> Response:
        """Return the response term of the gradient in the parameters `leader` (P in total).

        Args:
            ratio: (m,) probability ratios of the designs of `episodes`, differentiable in `leader`.
            episodes: (m,) numbers of episodes, in the batch's order.
            turn: number of the gradient step.
            leader: the designer's parameters.
        """
        rows = self.compute.tensor(self.rows(episodes, turn))
        index = rows.flatten()
        mean, log_std = self.actor.control(self.steps.observation[index])
        log_prob, _ = gaussian(mean, log_std, self.steps.control[index])
        old_log_prob, advantage = self.steps.log_prob[index], self.advantage[index]
        # What the controller's parameters do for the return: the leader's loss, as a function of them alone.
        leader_loss, _ = self.loss(log_prob, old_log_prob, advantage, advantage.new_zeros(()))
        # What the designs do to the controller's update: an episode counts for it by the ratio of its design. The ratio
        # of a control is not clipped, as the clipping has no slope in the designer's parameters.
        gain = ((log_prob - old_log_prob).exp() * advantage).view(rows.shape).mean(1)
        follower_loss = -(ratio * gain).mean()
        return response_term(
            follower_loss,
            flat_gradient(leader_loss, self.parameters, retain_graph=True),
            hessian_product(divergence(mean, log_std), self.parameters, self.config.response_damping),
            leader,
            self.parameters,
            self.config.cg_iterations,
            self.config.cg_tolerance,
        )


class LeaderUpdate(PolicyUpdate):
    """One batch's update of the designer, with the controller's response."""

    def __init__(self, *plain: Any, follower: Follower) -> None:
        super().__init__(*plain)
        self.follower = follower
        self.logged: dict[str, float] = {}
        """Of the last gradient step: how the response term compares with the direct gradient."""

    def descend(self, loss: Tensor, rows: Slots) -> None:
        """Take one gradient step on `loss` (), that of the design steps `rows` (m,), and on the response to it."""
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        moved = [(parameter, parameter.grad) for parameter in self.parameters if parameter.grad is not None]
        direct = torch.cat([gradient.flatten() for _, gradient in moved])
        index = torch.from_numpy(rows).to(self.advantage.device)
        ratio = (self.log_probs(rows)[0] - self.old_log_prob[index]).exp()
        response = self.follower.response(ratio, rows, self.steps, [parameter for parameter, _ in moved])
        tiny = torch.finfo(direct.dtype).tiny
        share = response.gradient.norm() / direct.norm().clamp_min(tiny)
        scale = (self.follower.config.response_limit / share.clamp_min(tiny)).clamp_max(1.0)
        parts = response.gradient.split([gradient.numel() for _, gradient in moved])
        for (_, gradient), part in zip(moved, parts, strict=True):
            gradient.sub_(scale * part.view_as(gradient))
        clipped_step(self.optimizer, self.parameters, self.loss.max_gradient_norm)
        self.logged = {
            "response_ratio": float(share),
            "response_cosine": float(torch.cosine_similarity(direct, response.gradient, dim=0)),
            "cg_iterations": float(response.iterations),
        }


class StackelbergCredit(SeparateCredit):
    """Separate credit with a designer that leads: it is updated first, and anticipates the controller's update."""

    config: StackelbergConfig

    def lead(self, batch: Trajectories, steps: Steps, advantage: Tensor) -> dict[str, float]:
        """Update the designer and its value network on the design steps of `batch`."""
        rng = self.streams["response steps"]
        follower = Follower(self.config, self.actor, steps, advantage, self.compute, rng)
        policy, metrics = self.learn_designs(batch, partial(LeaderUpdate, follower=follower))
        return metrics | policy.logged

    def learn(self, batch: Trajectories) -> dict[str, float]:
        """Do nothing: the designer has led."""
        return {}


class StackelbergLearner(TwoPhaseLearner):
    """The two-phase learner with a designer that leads; designer and controller must share no parameter."""

    config: StackelbergConfig

    def make_credit(self) -> DesignCredit:
        """Return the leader's credit."""
        task = self.problem.task
        return StackelbergCredit(task, self.config, self.streams, self.actor, self.compute, self.loop)


def control_steps(designing: Booleans) -> list[Slots]:
    """Return the rows of the control steps of each episode; `designing` (n,) marks the design steps, which begin it."""
    return [rows[1:] for rows in np.split(np.arange(len(designing)), np.flatnonzero(designing))[1:]]


def divergence(mean: Tensor, log_std: Tensor) -> Tensor:
    """Return the mean KL divergence () of Gaussians with means (m, A) from constant copies of themselves.

    It is zero, and so is its gradient. Its second derivative is the Fisher information.
    """
    own = Normal(mean, log_std.exp())
    copy = Normal(mean.detach(), log_std.exp().detach())
    return kl_divergence(own, copy).sum(-1).mean()
