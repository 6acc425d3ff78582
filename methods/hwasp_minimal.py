"""Hardware as policy, minimal: one design for all goals, as trainable parameters, with the paper's controller.

Source: the paper's baseline after Chen et al. 2020 ("Hardware as Policy", without differentiable physics) and Ha 2018:
policy-gradient optimisation of a single set of design parameters together with the controller. It uses the
optimiser settings of `gnn_ppo` (appendix "Training Hyperparameters & Architecture Details for Baselines").
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from codesign_bench.config.settings import Settings
from codesign_bench.learning.actor import Actor
from codesign_bench.learning.graph_actor import GraphController
from codesign_bench.learning.ppo_config import GraphConfig
from codesign_bench.learning.ppo_method import PPOMethod
from codesign_bench.learning.value_networks import GraphValue, ValueNetwork
from codesign_bench.task import Task

from ._settings import SMALL_GRAPHS, SMALL_PPO, Tuned, ppo_settings, tuned


@dataclass(frozen=True, kw_only=True)
class Config(GraphConfig):
    """Hyperparameters of `hwasp_minimal`: PPO's and the graph networks'."""


TUNED: Tuned = {
    "laptop": {"design_credit": "separate", "design_learning_rate": 2e-2, "design_kl_threshold": 0.3},
    "quick": {},
}
"""Settings tuned for this baseline (ours). A bare vector needs larger steps than a network; joint credit gives it the
controller's."""


class SingleDesignActor(Actor):
    """A Gaussian over designs whose mean is a parameter vector, and a graph-network controller."""

    def __init__(self, task: Task, config: Config, rng: np.random.Generator) -> None:
        super().__init__()
        self.mean_design = nn.Parameter(torch.zeros(task.design_space.size))
        self.controller = GraphController(task, config.control_gnn, config.control_index_mlp, rng)
        sizes = task.design_space.size, task.control_space.size
        self.add_log_stds(*sizes, config.design_log_std, config.control_log_std, config.fix_std)

    def design(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean (B, D), the same for all goals, and log standard deviation (D,) of designs."""
        return self.mean_design.expand(len(observation), -1), self.design_log_std

    def control(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean (B, C) and log standard deviation (C,) of controls."""
        return self.controller(observation), self.control_log_std

    def design_parameters(self) -> list[nn.Parameter]:
        """Return the design itself."""
        return [self.mean_design, self.design_log_std]

    def control_parameters(self) -> list[nn.Parameter]:
        """Return the controller's parameters."""
        return [*self.controller.parameters(), self.control_log_std]

    def update_statistics(self, observation: Tensor, is_design: Tensor) -> None:
        """Update the controller's normalisation."""
        self.controller.update_statistics(observation[~is_design])


class HwaspMinimal(PPOMethod[Config]):
    """One goal-independent design as trainable parameters, updated by policy gradient with the controller."""

    name = "hwasp_minimal"
    label = "HWasP-minimal"
    tool_per_goal = False
    config_class = Config

    @classmethod
    def small(cls) -> Mapping[str, Any]:
        """Return batches of a few episodes and small networks."""
        return {**SMALL_PPO, **SMALL_GRAPHS}

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Settings:
        """Return `gnn_ppo`'s settings, with those tuned for this baseline."""
        return {**ppo_settings(profile, task_name), **tuned(profile, TUNED)}

    @classmethod
    def make_actor(cls, task: Task, config: Config, rng: np.random.Generator) -> Actor:
        """Return design and controller."""
        return SingleDesignActor(task, config, rng)

    @classmethod
    def make_value(cls, task: Task, config: Config, rng: np.random.Generator) -> ValueNetwork:
        """Return the graph value network."""
        return GraphValue(task, config.control_gnn, config.value_mlp, rng)
