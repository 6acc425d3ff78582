"""The paper's own framework: goal-conditioned designer and controller as graph networks, trained jointly by PPO.

With `design_credit="joint"`, the default. With `separate`, it is our variant of it.

Source: the paper, sections "Policy learning" and "Training Hyperparameters & Architecture Details for Our Framework".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from torch import Tensor, nn

from codesign_bench.config.settings import Settings
from codesign_bench.learning.actor import Actor
from codesign_bench.learning.graph_actor import GraphController, GraphDesigner
from codesign_bench.learning.ppo_config import GraphConfig
from codesign_bench.learning.ppo_method import PPOMethod
from codesign_bench.learning.value_networks import GraphValue, ValueNetwork
from codesign_bench.task import Task

from ._settings import SMALL_GRAPHS, SMALL_PPO, ppo_settings


@dataclass(frozen=True, kw_only=True)
class Config(GraphConfig):
    """Hyperparameters of `gnn_ppo`: PPO's and the graph networks'."""


class GraphActor(Actor):
    """Separate graph networks for the design and the control phase."""

    def __init__(self, task: Task, config: Config, rng: np.random.Generator) -> None:
        super().__init__()
        self.designer = GraphDesigner(task, config.design_gnn, config.design_index_mlp, rng)
        self.controller = GraphController(task, config.control_gnn, config.control_index_mlp, rng)
        sizes = task.design_space.size, task.control_space.size
        self.add_log_stds(*sizes, config.design_log_std, config.control_log_std, config.fix_std)

    def design(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean (B, D) and log standard deviation (D,) of designs."""
        return self.designer(observation), self.design_log_std

    def control(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean (B, C) and log standard deviation (C,) of controls."""
        return self.controller(observation), self.control_log_std

    def design_parameters(self) -> list[nn.Parameter]:
        """Return the designer's parameters."""
        return [*self.designer.parameters(), self.design_log_std]

    def control_parameters(self) -> list[nn.Parameter]:
        """Return the controller's parameters."""
        return [*self.controller.parameters(), self.control_log_std]

    def update_statistics(self, observation: Tensor, is_design: Tensor) -> None:
        """Update each network's normalisation with its own phase's observations."""
        self.designer.update_statistics(observation[is_design])
        self.controller.update_statistics(observation[~is_design])


class GnnPpo(PPOMethod[Config]):
    """Designer and controller as graph networks, conditioned on the goal, trained together by PPO."""

    name = "gnn_ppo"
    label = "GNN-PPO"
    config_class = Config

    @classmethod
    def label_of(cls, config: Config) -> str:
        """Return the name with the credit of the design step: with `joint` it is the paper's method, else a variant."""
        return f"{cls.label}, {config.design_credit} credit"

    @classmethod
    def small(cls) -> Mapping[str, Any]:
        """Return batches of a few episodes and small networks."""
        return {**SMALL_PPO, **SMALL_GRAPHS}

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Settings:
        """Return the optimiser's settings."""
        return ppo_settings(profile, task_name)

    @classmethod
    def make_actor(cls, task: Task, config: Config, rng: np.random.Generator) -> Actor:
        """Return designer and controller."""
        return GraphActor(task, config, rng)

    @classmethod
    def make_value(cls, task: Task, config: Config, rng: np.random.Generator) -> ValueNetwork:
        """Return the graph value network."""
        return GraphValue(task, config.control_gnn, config.value_mlp, rng)
