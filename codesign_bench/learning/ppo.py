"""Proximal policy optimisation (Schulman et al. 2017): the clipped update of a policy, and that of a value network.

Shapes: `n` rows of a batch, `m` rows of a minibatch, `O` observation, `A` action. The update does not depend on phases:
a policy is a function from row indices to log-probabilities and entropy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import torch
from torch import Tensor, nn

from codesign_bench.learning.ppo_config import PPOConfig
from codesign_bench.task import Booleans, Slots

LogProbs = Callable[[Slots], tuple[Tensor, Tensor]]
"""Maps row indices (m,) to the log-probabilities (m,) of their actions and the mean entropy ()."""
Mean = Callable[[Tensor], Tensor]
"""Maps values (m,) of a minibatch's rows to their mean ()."""


@dataclass(frozen=True)
class PolicyLoss:
    """The clipped surrogate objective and its limits."""

    clip_ratio: float
    entropy_weight: float
    kl_threshold: float
    """The policy update stops when a minibatch's estimated KL divergence from the old policy exceeds this."""
    max_gradient_norm: float

    @classmethod
    def of(cls, config: PPOConfig, kl_threshold: float) -> PolicyLoss:
        """Return the loss of `config` with this limit on the KL divergence."""
        return cls(config.clip_ratio, config.entropy_weight, kl_threshold, config.max_gradient_norm)

    def __call__(
        self, log_prob: Tensor, old_log_prob: Tensor, advantage: Tensor, entropy: Tensor, mean: Mean = torch.mean
    ) -> tuple[Tensor, Tensor]:
        """Return loss () and the estimated KL divergence () (Schulman's k3 estimator) for (m,) inputs."""
        log_ratio = log_prob - old_log_prob
        ratio = log_ratio.exp()
        # The minimum removes any gain beyond the clipping range but keeps the loss there: a step that went too far in
        # the wrong direction is still corrected.
        clipped = ratio.clamp(1.0 - self.clip_ratio, 1.0 + self.clip_ratio)
        surrogate = mean(torch.minimum(ratio * advantage, clipped * advantage))
        with torch.no_grad():  # unbiased like -log_ratio, but never negative: less variance on few rows
            divergence = mean(ratio - 1.0 - log_ratio)
        return -surrogate - self.entropy_weight * entropy, divergence


class Update(Protocol):
    """One batch's update of one network."""

    def step(self, rows: Slots) -> None:
        """Take one gradient step on `rows` (m,)."""


class PolicyUpdate:
    """One batch's policy update; stops permanently once the KL divergence is too large."""

    def __init__(
        self,
        loss: PolicyLoss,
        log_probs: LogProbs,
        optimizer: torch.optim.Optimizer,
        old_log_prob: Tensor,
        advantage: Tensor,
    ) -> None:
        self.loss, self.log_probs, self.optimizer = loss, log_probs, optimizer
        self.old_log_prob, self.advantage = old_log_prob, advantage
        self.parameters = trained(optimizer)
        self.stopped = False
        self.steps = 0
        self.divergence = 0.0

    def step(self, rows: Slots) -> None:
        """Take one gradient step on `rows` (m,), unless the update has stopped."""
        if self.stopped:
            return
        index = torch.from_numpy(rows).to(self.advantage.device)
        log_prob, entropy = self.log_probs(rows)
        loss, divergence = self.loss(log_prob, self.old_log_prob[index], self.advantage[index], entropy)
        self.divergence = float(divergence)
        # Checked before the step, so that a step that would go further is not taken. Advantages were estimated for the
        # policy that collected the batch and are unreliable this far from it, so the rest of the batch is not used.
        if self.divergence > self.loss.kl_threshold:
            self.stopped = True
            return
        self.descend(loss, rows)
        self.steps += 1

    def descend(self, loss: Tensor, rows: Slots) -> None:
        """Take one gradient step on `loss` (), that of `rows` (m,)."""
        gradient_step(loss, self.optimizer, self.parameters, self.loss.max_gradient_norm)


class ValueUpdate:
    """One batch's value update: regression of `predict` on the targets by mean squared error."""

    def __init__(
        self,
        predict: Callable[[Tensor], Tensor],
        optimizer: torch.optim.Optimizer,
        observation: Tensor,
        target: Tensor,
        max_norm: float,
    ) -> None:
        self.predict, self.optimizer, self.observation, self.target = predict, optimizer, observation, target
        self.parameters = trained(optimizer)
        self.max_norm = max_norm
        self.loss = 0.0

    def step(self, rows: Slots) -> None:
        """Take one gradient step on `rows` (m,)."""
        index = torch.from_numpy(rows).to(self.target.device)
        loss = nn.functional.mse_loss(self.predict(self.observation[index]), self.target[index])
        gradient_step(loss, self.optimizer, self.parameters, self.max_norm)
        self.loss = float(loss.detach())


def trained(optimizer: torch.optim.Optimizer) -> list[nn.Parameter]:
    """Return the parameters that an optimizer trains."""
    return [parameter for group in optimizer.param_groups for parameter in group["params"]]


def gradient_step(
    loss: Tensor, optimizer: torch.optim.Optimizer, parameters: list[nn.Parameter], max_norm: float
) -> None:
    """Take one step on `loss` with a clipped gradient norm."""
    optimizer.zero_grad(set_to_none=True)
    loss.backward()
    clipped_step(optimizer, parameters, max_norm)


def clipped_step(optimizer: torch.optim.Optimizer, parameters: list[nn.Parameter], max_norm: float) -> None:
    """Take one step on the gradients that the parameters have, with their norm clipped."""
    nn.utils.clip_grad_norm_([p for p in parameters if p.grad is not None], max_norm)
    optimizer.step()


def minibatches(count: int, size: int, rng: np.random.Generator, first: Booleans | None = None) -> Iterator[Slots]:
    """Yield a random partition of `count` rows into near-equal minibatches of about `size` rows.

    Rows that `first` (count,) marks come before all others; both kinds are shuffled.
    """
    order = rng.permutation(count)
    if first is not None:
        order = np.concatenate([order[first[order]], order[~first[order]]])
    # Near-equal parts: a fixed size would leave a remainder, possibly of one row, whose gradient is mostly noise but
    # moves Adam as far as any other.
    yield from np.array_split(order, max(1, round(count / size)))


def normalized(values: Tensor) -> Tensor:
    """Return (n,) values with mean 0 and standard deviation 1; all zero if the values are equal."""
    spread = values.std(unbiased=False)
    return (values - values.mean()) / (spread + 1e-8)


def gaussian(mean: Tensor, log_std: Tensor, action: Tensor) -> tuple[Tensor, Tensor]:
    """Return log-probabilities (m,) of actions (m, A) under a diagonal Gaussian, and its entropy ()."""
    noise = (action - mean) * torch.exp(-log_std)
    constant = log_std.sum() + 0.5 * float(np.log(2.0 * np.pi)) * log_std.numel()
    return -0.5 * (noise**2).sum(-1) - constant, constant + 0.5 * log_std.numel()
