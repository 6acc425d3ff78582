"""Credit assignment for the design step: three ways to train the designer, or not to train it.

Shapes: `n` valid steps of a batch, `d` its design steps, `m` rows of a minibatch, `O` observation, `D` design,
`C` control.

`JointCredit` (the paper's): the design step is an ordinary step of the episode, with a discounted advantage, in the
same minibatches as the control steps. `SeparateCredit` (ours, after the temporal credit assignment of BodyGen, 2025):
the design step's advantage is the undiscounted return minus the prediction of a second value network, normalised
separately; the designer has its own updates and its own KL stop. `NoCredit`: designs are not chosen by the policy.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import torch
from torch import Tensor, nn

from codesign_bench.learning.actor import LOG_PROB, Actor, Distribution
from codesign_bench.learning.compute import Compute
from codesign_bench.learning.gae import episode_returns
from codesign_bench.learning.optimizers import adam
from codesign_bench.learning.ppo import LogProbs, PolicyLoss, PolicyUpdate, ValueUpdate, gaussian, normalized
from codesign_bench.learning.ppo_config import PPOConfig
from codesign_bench.learning.trajectories import Trajectories
from codesign_bench.learning.update_loop import UpdateLoop
from codesign_bench.learning.value_networks import DesignValue
from codesign_bench.seeding import Streams
from codesign_bench.task import Booleans, Slots, Task

Kind = TypeVar("Kind", bound=PolicyUpdate)
MakeUpdate = Callable[[PolicyLoss, LogProbs, torch.optim.Optimizer, Tensor, Tensor], Kind]
"""Makes an update of the designer from the arguments of `PolicyUpdate`."""


@dataclass(frozen=True)
class Steps:
    """The valid steps of a batch as tensors on the device of updates."""

    observation: Tensor
    """(n, O)"""
    is_design: Tensor
    """(n,)"""
    design: Tensor
    """(n, D)"""
    control: Tensor
    """(n, C)"""
    log_prob: Tensor
    """(n,) log-probabilities of the actions under the policy that took them."""
    designing: Booleans
    """(n,) `is_design` in main memory, where rows are chosen: asking the device would wait for all that it does."""

    @classmethod
    def of(cls, batch: Trajectories, compute: Compute) -> Steps:
        """Return all valid steps of `batch`."""

        def of_valid(array: np.ndarray) -> Tensor:
            return compute.tensor(array[batch.valid])

        return cls(
            observation=of_valid(batch.observation),
            is_design=of_valid(batch.is_design),
            design=of_valid(batch.design),
            control=of_valid(batch.control),
            log_prob=of_valid(batch.extras[LOG_PROB]),
            designing=batch.is_design[batch.valid],
        )


class DesignCredit(ABC):
    """How the design step is learned in addition to the control steps."""

    def __init__(self, actor: Actor, compute: Compute) -> None:
        self.actor, self.compute = actor, compute
        self.modules: dict[str, nn.Module] = {}
        """Additional networks by name."""
        self.optimizers: dict[str, torch.optim.Optimizer] = {}
        """Additional optimizers by name."""

    def policy_parameters(self) -> list[nn.Parameter]:
        """Return the parameters that the batch's policy update trains: by default the controller's."""
        return self.actor.control_parameters()

    def learned(self, designing: Booleans) -> Booleans:
        """Return which steps (n,) the batch's policy update learns from: by default the control steps."""
        return ~designing

    def phases(self, steps: Steps) -> list[tuple[Distribution, Tensor]]:
        """Return what that update trains, the controller first, each with its actions (n, A) in `steps`."""
        return [(self.actor.control, steps.control)]

    def log_probs(self, steps: Steps) -> LogProbs:
        """Return the function that maps rows of `steps` to log-probabilities and mean entropy."""

        def of_controls(rows: Slots) -> tuple[Tensor, Tensor]:
            index = self.compute.tensor(rows)
            distribution = self.compute.distribution(self.actor.control, steps.observation[index])
            return gaussian(*distribution, steps.control[index])

        return of_controls

    def lead(self, batch: Trajectories, steps: Steps, advantage: Tensor) -> dict[str, float]:
        """Learn from the design steps before the batch's policy update; return the logged values. By default nothing.

        Args:
            batch: the batch.
            steps: its valid steps.
            advantage: (n,) advantages that the policy update will use, zero at steps that it does not learn from.
        """
        return {}

    @abstractmethod
    def learn(self, batch: Trajectories) -> dict[str, float]:
        """Learn from the design steps outside of the batch's policy update; return the logged values."""


class NoCredit(DesignCredit):
    """Designs are fixed: only control steps are learned."""

    def learn(self, batch: Trajectories) -> dict[str, float]:
        """Learn nothing."""
        return {}


class JointCredit(DesignCredit):
    """The design step is learned like any other step."""

    def policy_parameters(self) -> list[nn.Parameter]:
        """Return the parameters of controller and designer, with shared ones listed once."""
        control = self.actor.control_parameters()
        known = {id(p) for p in control}
        return control + [p for p in self.actor.design_parameters() if id(p) not in known]

    def learned(self, designing: Booleans) -> Booleans:
        """Return all steps (n,)."""
        return np.ones_like(designing)

    def phases(self, steps: Steps) -> list[tuple[Distribution, Tensor]]:
        """Return controller and designer with their actions (n, A)."""
        return [*super().phases(steps), (self.actor.design, steps.design)]

    def log_probs(self, steps: Steps) -> LogProbs:
        """Return the function that maps rows of `steps` to log-probabilities and mean entropy over both phases."""

        def of_both(rows: Slots) -> tuple[Tensor, Tensor]:
            designing = steps.designing[rows]
            log_prob, entropy = steps.observation.new_zeros(len(rows)), steps.observation.new_zeros(())
            # Each network is evaluated only on the rows of its phase, which is less work than both networks on all rows
            # and a selection afterwards. index_copy restores the order of the rows; gradients pass through it.
            for (phase, action), where in zip(self.phases(steps), (~designing, designing), strict=True):
                if where.any():  # a small minibatch may contain no design step
                    chosen = self.compute.tensor(rows[where])
                    observation = self.compute.whole_blocks(steps.observation[chosen])
                    mean, log_std = self.compute.distribution(phase, observation)
                    part, part_entropy = gaussian(mean[: len(chosen)], log_std, action[chosen])
                    log_prob = log_prob.index_copy(0, self.compute.tensor(np.flatnonzero(where)), part)
                    # Weighted by the phase's share of rows: the mean entropy of the actions taken.
                    entropy = entropy + float(where.mean()) * part_entropy
            return log_prob, entropy

        return of_both

    def learn(self, batch: Trajectories) -> dict[str, float]:
        """Do nothing: the batch's policy update has learned from all steps."""
        return {}


class SeparateCredit(DesignCredit):
    """Each design is credited with the undiscounted return of its episode, and learned by separate updates."""

    def __init__(
        self, task: Task, config: PPOConfig, streams: Streams, actor: Actor, compute: Compute, loop: UpdateLoop
    ) -> None:
        super().__init__(actor, compute)
        self.config, self.streams, self.loop = config, streams, loop
        self.value = DesignValue(task, streams["design value weights"])
        self.modules["design_value"] = self.value
        self.optimizers["design"] = adam(actor.design_parameters(), config.design_learning_rate)
        self.optimizers["design_value"] = adam(self.value.parameters(), config.value_learning_rate)

    def learn(self, batch: Trajectories) -> dict[str, float]:
        """Update the designer and its value network on the design steps (d,) of `batch`."""
        return self.learn_designs(batch, PolicyUpdate)[1]

    def learn_designs(self, batch: Trajectories, update: MakeUpdate[Kind]) -> tuple[Kind, dict[str, float]]:
        """Update the designer and its value network; return the designer's update and the logged values."""
        config, tensor = self.config, self.compute.tensor
        where = batch.is_design & batch.valid
        observation, design = tensor(batch.observation[where]), tensor(batch.design[where])
        # Undiscounted: the design matters at every step of the episode, and discounting would suppress late success.
        returns = tensor(episode_returns(batch.reward, batch.episode_end)[where].astype(np.float32))
        if config.normalize_observations:
            self.value.update_statistics(observation)
        # The statistics are updated before the prediction: in the first batch, the untrained network, whose output is
        # near 0, then predicts about the mean return instead of 0.
        self.value.update_returns(returns)
        with torch.no_grad():
            advantage = normalized(returns - self.value.denormalized(observation))
        log_probs, rows = self._of_designs(observation, design), np.arange(len(returns))
        with torch.no_grad():
            # Of the designer as it is now, not of the rollout's: where both phases share a trunk, the control update
            # has just moved the designer too, and measured from the rollout the KL stop would end the design update
            # for what the control update did.
            old_log_prob = log_probs(rows)[0]
        loss = PolicyLoss.of(config, config.design_kl_threshold)
        policy = update(loss, log_probs, self.optimizers["design"], old_log_prob, advantage)
        target = self.value.normalized(returns)
        value = ValueUpdate(self.value, self.optimizers["design_value"], observation, target, config.max_gradient_norm)
        rng = self.streams["design minibatches"]
        self.loop.run((policy, value), rows, config.design_epochs, config.design_minibatch_size, rng)
        logged = {"design_kl": policy.divergence, "design_steps": float(policy.steps), "design_value_loss": value.loss}
        return policy, logged

    def _of_designs(self, observation: Tensor, design: Tensor) -> LogProbs:
        """Return the log-probabilities of designs (d, D) for their observations (d, O) as a function of rows."""

        def of_designs(rows: Slots) -> tuple[Tensor, Tensor]:
            index = self.compute.tensor(rows)
            mean, log_std = self.actor.design(observation[index])
            return gaussian(mean, log_std, design[index])

        return of_designs
