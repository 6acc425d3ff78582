"""The actor of a two-phase PPO learner: one Gaussian over designs and one over controls.

Shapes: `b` slots that step together, `B` batch, `O` observation, `A` action, `D` design, `C` control.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from functools import partial

import numpy as np
import torch
from torch import Tensor, nn

from codesign_bench.learning.explorer import Explorer, Sample
from codesign_bench.learning.network_policy import NetworkPolicy
from codesign_bench.task import Singles, Slots

Distribution = Callable[[Tensor], tuple[Tensor, Tensor]]
"""Maps observations (B, O) to the mean (B, A) and log standard deviation (A,) of actions."""

LOG_PROB = "log_prob"
"""The extra (b,) that a `GaussianExplorer` stores: log-probabilities of its actions."""
LOG_SQRT_TWO_PI = 0.5 * float(np.log(2.0 * np.pi))


class Actor(nn.Module):
    """Designer and controller. The log standard deviations are learned unless `fix_std` is set."""

    design_log_std: nn.Parameter
    control_log_std: nn.Parameter

    def add_log_stds(self, design: int, control: int, design_log_std: float, control_log_std: float, fix: bool) -> None:
        """Add one log standard deviation per design parameter and per control, learned unless `fix`."""
        self.design_log_std = nn.Parameter(torch.full((design,), design_log_std), requires_grad=not fix)
        self.control_log_std = nn.Parameter(torch.full((control,), control_log_std), requires_grad=not fix)

    @abstractmethod
    def design(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean (B, D) and log standard deviation (D,) of the designs for observations (B, O)."""

    @abstractmethod
    def control(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean (B, C) and log standard deviation (C,) of the controls for observations (B, O)."""

    @abstractmethod
    def design_parameters(self) -> list[nn.Parameter]:
        """Return the parameters that the design step's loss trains."""

    @abstractmethod
    def control_parameters(self) -> list[nn.Parameter]:
        """Return the parameters that the control steps' loss trains."""

    @abstractmethod
    def update_statistics(self, observation: Tensor, is_design: Tensor) -> None:
        """Update the running normalisation with observations (B, O); `is_design` (B,) marks design steps."""


class GaussianExplorer(Explorer):
    """Samples from an actor's Gaussians and stores the log-probability of every action."""

    def __init__(self, actor: Actor) -> None:
        super().__init__(actor.design_log_std.numel(), actor.control_log_std.numel())
        self.actor = actor

    def sample_design(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Return designs drawn with `noise` (b, D)."""
        return _sample(self.actor.design, observation, noise)

    def sample_control(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Return controls drawn with `noise` (b, C)."""
        return _sample(self.actor.control, observation, noise)


class ActorPolicy(NetworkPolicy):
    """An actor that acts with its means."""

    def __init__(self, actor: Actor) -> None:
        super().__init__(actor, partial(_mean, actor.design), partial(_mean, actor.control))


def gaussian_log_prob(noise: Singles, log_std: Singles) -> Singles:
    """Return the (b,) log-probabilities of mean + exp(log_std) noise for standard-normal `noise` (b, A)."""
    # From the noise itself instead of (action - mean) / std, which would add rounding errors. This is the density of
    # the action before it is clipped to [-1, 1]: a clipped Gaussian has no density at the bounds, and the loss
    # evaluates the new policy at the same unclipped action, so the ratio is exact.
    result: Singles = -0.5 * (noise**2).sum(axis=-1) - (log_std + LOG_SQRT_TWO_PI).sum()
    return result


def _mean(distribution: Distribution, observation: Tensor) -> Tensor:
    # Not a lambda, for a policy is sent to other processes by pickle.
    return distribution(observation)[0]


def _sample(distribution: Distribution, observation: Singles, noise: Singles) -> Sample:
    # The episode clips the sample, not this function: the learner needs the action that the Gaussian produced.
    with torch.inference_mode():
        mean, log_std = (values.numpy() for values in distribution(torch.from_numpy(observation)))
    return Sample(mean + np.exp(log_std) * noise, {LOG_PROB: gaussian_log_prob(noise, log_std)})
