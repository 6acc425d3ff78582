"""Advantages and value targets of a batch, from one value network for both phases.

Shapes: `S` slots, `T` steps, `n` valid steps of a batch, `B` batch, `O` observation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from codesign_bench.learning.compute import Compute
from codesign_bench.learning.gae import generalized_advantages
from codesign_bench.learning.ppo_config import PPOConfig
from codesign_bench.learning.trajectories import Trajectories
from codesign_bench.learning.value_networks import ValueNetwork
from codesign_bench.task import Floats, Singles


@dataclass(frozen=True)
class Estimates:
    """Estimates for a batch from the value network before its update."""

    advantage: Tensor
    """(n,)"""
    target: Tensor
    """(n,) the network's training targets: returns, normalised if the network learns normalised returns."""
    explained_variance: float
    """Fraction of the returns' variance that the network explains."""


class Critic:
    """Estimates the advantages of a batch's steps by generalised advantage estimation."""

    def __init__(self, value: ValueNetwork, config: PPOConfig, compute: Compute) -> None:
        self.value, self.config, self.compute = value, config, compute

    def estimate(self, batch: Trajectories, observation: Tensor) -> Estimates:
        """Return the estimates for the valid steps of `batch`, with observations `observation` (n, O)."""
        value, next_value = self._values(batch, observation)
        advantage = self._advantages(batch, value, next_value)
        # The lambda-return: the same mixture of estimates as the advantage, so that both agree on what a step is worth.
        returns = (advantage + value)[batch.valid]
        explained = 1.0 - float(np.var(returns - value[batch.valid]) / (np.var(returns) + 1e-12))
        target = self.compute.tensor(returns.astype(np.float32))
        # Advantages above are already computed in the units of rewards, with the statistics that the network was
        # trained under. Only now may these change, and the targets then use the new ones.
        if self.config.normalize_returns:
            self.value.update_returns(target)
        normal = self.compute.tensor(advantage[batch.valid].astype(np.float32))
        return Estimates(normal, self.value.normalized(target), explained)

    def _values(self, batch: Trajectories, observation: Tensor) -> tuple[Floats, Floats]:
        """Return the values of the states before and after each step, (S, T) each.

        After termination the second is ignored. At the time limit it is the value of the final state, if bootstrapped.
        """
        value, next_value = np.zeros(batch.valid.shape), np.zeros(batch.valid.shape)
        with torch.inference_mode():
            value[batch.valid] = self._predict(observation)
            # A step's next observation is the one stored with the following step, so the network is evaluated once per
            # step. This is wrong only at ends of episodes, where the next row is the next episode's design step.
            next_value[:, :-1] = value[:, 1:]
            if self.config.bootstrap_time_limit and batch.truncated.any():
                final = self.compute.tensor(batch.final_observation[batch.truncated])
                next_value[batch.truncated] = self._predict(final)
        return value, next_value

    def _advantages(self, batch: Trajectories, value: Floats, next_value: Floats) -> Floats:
        config = self.config
        return generalized_advantages(
            reward=batch.reward,
            value=value,
            next_value=next_value,
            terminated=batch.terminated if config.bootstrap_time_limit else batch.episode_end,
            episode_end=batch.episode_end,
            gamma=config.gamma,
            gae_lambda=config.gae_lambda,
        )

    def _predict(self, observation: Tensor) -> Singles:
        """Return the expected returns (B,) for observations (B, O), in chunks that fit in the processor's cache."""
        parts = [self.value.denormalized(part) for part in observation.split(self.config.minibatch_size)]
        values: Singles = torch.cat(parts).cpu().numpy()
        return values
