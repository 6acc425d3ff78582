"""The paper's ablation "Ours (shared arch.)": one multilayer perceptron with a design and a control head.

Source: the paper, appendix "Training Hyperparameters & Architecture Details for Baselines": MLPs of 5 x 256 for policy
and value, with at least as many trainable parameters as `gnn_ppo` on every task.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from torch import Tensor, nn

from codesign_bench.learning.actor import Actor
from codesign_bench.learning.features import Features
from codesign_bench.learning.networks import MLP, RunningNorm, torch_generator
from codesign_bench.learning.ppo_config import PerceptronConfig
from codesign_bench.learning.ppo_method import PPOMethod
from codesign_bench.learning.profiles import Tuned, paper_perceptrons, ppo_profile, sourced, tuned
from codesign_bench.learning.value_networks import MLPValue, ValueNetwork
from codesign_bench.studies.corl2023.learners import SHARED_ARCH
from codesign_bench.task import Task


@dataclass(frozen=True, kw_only=True)
class Config(PerceptronConfig):
    """Hyperparameters of `shared_arch`: PPO's and the perceptrons'."""


TUNED: Tuned = {"laptop": {}, "quick": {}}
"""What was tuned for this baseline (ours)."""

WIDER: Mapping[tuple[str, str], int] = {
    ("paper", "fetch_cube"): 288,
    ("paper", "lift_cup"): 304,
    ("paper", "scoop_3d"): 336,
    ("laptop", "lift_cup"): 224,
    ("laptop", "scoop_3d"): 224,
    ("quick", "lift_cup"): 224,
    ("quick", "scoop_3d"): 224,
}
"""Width of all layers where the profile's own would have fewer parameters than `gnn_ppo`'s networks.

The paper's table says 256 everywhere and its text that no task has fewer parameters than the paper's own method; on the
3D tasks only one of them can hold. We keep the text's promise, with the next multiple of 16.
"""


class SharedActor(Actor):
    """One trunk for both phases, which the phase, an input, tells apart; a linear head for each."""

    def __init__(self, task: Task, config: Config, rng: np.random.Generator) -> None:
        super().__init__()
        generator = torch_generator(rng)
        self.features = Features(task)
        self.norm = RunningNorm.over(*self.features.boxes)
        self.trunk = MLP([self.features.flat_size, *config.policy_net], generator, activate_last=True)
        width = config.policy_net[-1]
        self.design_head = MLP([width, task.design_space.size], generator, output_scale=0.1)
        self.control_head = MLP([width, task.control_space.size], generator, output_scale=0.1)
        sizes = task.design_space.size, task.control_space.size
        self.add_log_stds(*sizes, config.design_log_std, config.control_log_std, config.fix_std)

    def design(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean (B, D) and log standard deviation (D,) of designs."""
        return self.design_head(self.trunk(self.features.flat(observation, self.norm))), self.design_log_std

    def control(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean (B, C) and log standard deviation (C,) of controls."""
        return self.control_head(self.trunk(self.features.flat(observation, self.norm))), self.control_log_std

    def design_parameters(self) -> list[nn.Parameter]:
        """Return trunk and design head."""
        return [*self.trunk.parameters(), *self.design_head.parameters(), self.design_log_std]

    def control_parameters(self) -> list[nn.Parameter]:
        """Return trunk and control head."""
        return [*self.trunk.parameters(), *self.control_head.parameters(), self.control_log_std]

    def update_statistics(self, observation: Tensor, is_design: Tensor) -> None:
        """Update the trunk's normalisation with both phases' observations."""
        self.norm.update(self.features.task(observation))


class SharedArch(PPOMethod[Config]):
    """One multilayer perceptron, conditioned on the goal, with a design and a control head."""

    name = "shared_arch"
    label = "shared architecture"
    config_class = Config

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Mapping[str, tuple[Any, str]]:
        """Return `gnn_ppo`'s optimiser settings with the table's exceptions, or what was tuned for this baseline."""
        exceptions = paper_perceptrons(SHARED_ARCH, task_name) if profile == "paper" else {}
        return ppo_profile(profile, task_name) | exceptions | tuned(profile, TUNED) | _wider(profile, task_name)

    @classmethod
    def make_actor(cls, task: Task, config: Config, rng: np.random.Generator) -> Actor:
        """Return trunk and heads."""
        return SharedActor(task, config, rng)

    @classmethod
    def make_value(cls, task: Task, config: Config, rng: np.random.Generator) -> ValueNetwork:
        """Return the value perceptron."""
        return MLPValue(task, config.value_net, rng)


def _wider(profile: str, task_name: str) -> dict[str, tuple[Any, str]]:
    """Return the networks' widths where the profile's own would have too few parameters."""
    width = WIDER.get((profile, task_name))
    if width is None:
        return {}
    layers = len(SHARED_ARCH.policy_net) if profile == "paper" else len(Config().policy_net)
    return sourced(
        dict.fromkeys(("policy_net", "value_net"), (width,) * layers),
        "paper, text: no fewer parameters than the paper's own method",
    )
