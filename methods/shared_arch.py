"""The paper's ablation "Ours (shared arch.)": one multilayer perceptron with a design and a control head.

Source: the paper, appendix "Training Hyperparameters & Architecture Details for Baselines": MLPs of 5 x 256 for policy
and value, with at least as many trainable parameters as `gnn_ppo` on every task.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from torch import Tensor, nn

from codesign_bench.config.resolve import resolve
from codesign_bench.config.settings import Settings, sourced
from codesign_bench.learning.actor import Actor
from codesign_bench.learning.features import Features
from codesign_bench.learning.networks import MLP, RunningNorm, torch_generator
from codesign_bench.learning.ppo_config import PerceptronConfig
from codesign_bench.learning.ppo_method import PPOMethod
from codesign_bench.learning.value_networks import MLPValue, ValueNetwork
from codesign_bench.method import Method, load_method
from codesign_bench.task import Task, load_task

from ._settings import SMALL_PERCEPTRONS, SMALL_PPO, Tuned, ppo_settings, tuned


@dataclass(frozen=True, kw_only=True)
class Config(PerceptronConfig):
    """Hyperparameters of `shared_arch`: PPO's and the perceptrons'."""


TUNED: Tuned = {"laptop": {}, "quick": {}}
"""Settings tuned for this baseline (ours)."""

REFERENCE = "gnn_ppo"
"""`shared_arch` has at least as many trainable parameters as this method, in its policy and in total (paper)."""
WIDTH_STEP = 16
"""Layers are widened in steps of this size until there are enough parameters (ours)."""


class SharedActor(Actor):
    """One trunk for both phases, with the phase as an input, and a linear head for each phase."""

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
    def small(cls) -> Mapping[str, Any]:
        """Return batches of a few episodes and small networks."""
        return {**SMALL_PPO, **SMALL_PERCEPTRONS}

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Settings:
        """Return `gnn_ppo`'s optimiser settings, with those tuned for this baseline."""
        return {**ppo_settings(profile, task_name), **tuned(profile, TUNED)}

    @classmethod
    def derived(cls, config: Config, profile: str, task_name: str) -> Settings:
        """Return wider layers if the profile's would have fewer parameters than the paper's own method.

        The paper's table has width 256 for every task, and its text says that there are at least as many parameters as
        in the paper's own method. On the 3D tasks only one of the two is possible; we follow the text.
        """
        task, reference = load_task(task_name), load_method(REFERENCE)
        needed = parameter_counts(reference, task, resolve(reference, task_name, profile).method)
        widened = config
        while any(own < other for own, other in zip(parameter_counts(cls, task, widened), needed, strict=True)):
            policy_net, value_net = (
                tuple(width + WIDTH_STEP for width in layers) for layers in (widened.policy_net, widened.value_net)
            )
            widened = replace(widened, policy_net=policy_net, value_net=value_net)
        if widened == config:
            return {}
        widths = {"policy_net": widened.policy_net, "value_net": widened.value_net}
        return sourced(widths, "paper, text: no fewer parameters than the paper's own method")

    @classmethod
    def make_actor(cls, task: Task, config: Config, rng: np.random.Generator) -> Actor:
        """Return trunk and heads."""
        return SharedActor(task, config, rng)

    @classmethod
    def make_value(cls, task: Task, config: Config, rng: np.random.Generator) -> ValueNetwork:
        """Return the value perceptron."""
        return MLPValue(task, config.value_net, rng)


def parameter_counts(method_class: type[Method[Any]], task: Task, config: Any) -> tuple[int, int]:
    """Return the numbers of trainable parameters of a PPO-based method: of its policy, and of all its networks."""
    assert issubclass(method_class, PPOMethod)
    rng = np.random.default_rng(0)
    policy, value = (
        sum(parameter.numel() for parameter in network.parameters() if parameter.requires_grad)
        for network in (method_class.make_actor(task, config, rng), method_class.make_value(task, config, rng))
    )
    return policy, policy + value
