"""What methods share that choose designs without a policy for them: PPO for a controller that sees the design.

Shapes: `B` batch, `O` observation, `D` design, `C` control.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, TypeVar

import numpy as np
import torch
from torch import Tensor, nn

from codesign_bench.config.settings import Settings
from codesign_bench.learning.actor import Actor, ActorPolicy
from codesign_bench.learning.checkpointing import load_module_arrays
from codesign_bench.learning.explorer import Explorer, UniformDesigns
from codesign_bench.learning.features import Features
from codesign_bench.learning.networks import MLP, RunningNorm, torch_generator
from codesign_bench.learning.ppo_config import PerceptronConfig
from codesign_bench.learning.ppo_method import TwoPhaseMethod
from codesign_bench.learning.two_phase import TwoPhaseLearner
from codesign_bench.learning.value_networks import MLPValue
from codesign_bench.method import Policy, Problem
from codesign_bench.seeding import Streams
from codesign_bench.task import Floats, Task

from ._settings import SMALL_PERCEPTRONS, SMALL_PPO, ppo_settings

ConfigType = TypeVar("ConfigType", bound=PerceptronConfig)
WITHOUT_EFFECT = ("design_log_std", "design_learning_rate", "design_epochs", "design_kl_threshold")
"""For `not_searched`: PPO learns no designs."""


class GivenDesignActor(Actor):
    """A design that is the same for all goals, and a perceptron that controls any design."""

    best_design: Tensor

    def __init__(self, task: Task, config: PerceptronConfig, rng: np.random.Generator) -> None:
        super().__init__()
        self.features = Features(task)
        self.norm = RunningNorm.over(*self.features.boxes)
        self.register_buffer("best_design", torch.zeros(task.design_space.size))
        sizes = [self.features.flat_size, *config.policy_net, task.control_space.size]
        self.controller = MLP(sizes, torch_generator(rng), output_scale=0.1)
        self.add_log_stds(
            *(task.design_space.size, task.control_space.size), -np.inf, config.control_log_std, config.fix_std
        )

    def act_with(self, unit_design: Floats) -> None:
        """Act with this design (D,) from now on."""
        self.best_design.copy_(torch.from_numpy(unit_design))

    def design(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return the design (B, D) to act with, with standard deviation 0."""
        return self.best_design.expand(len(observation), -1), self.design_log_std

    def control(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean (B, C) and log standard deviation (C,) of controls."""
        return self.controller(self.features.flat(observation, self.norm)), self.control_log_std

    def design_parameters(self) -> list[nn.Parameter]:
        """Return no parameters: no gradient moves the design."""
        return []

    def control_parameters(self) -> list[nn.Parameter]:
        """Return the controller's parameters."""
        return [*self.controller.parameters(), self.control_log_std]

    def update_statistics(self, observation: Tensor, is_design: Tensor) -> None:
        """Update the controller's normalisation."""
        self.norm.update(self.features.task(observation[~is_design]))


class GivenDesignMethod(TwoPhaseMethod[ConfigType]):
    """PPO for a design-conditioned controller; a subclass may choose the designs that it is trained with."""

    config_class: ClassVar[type] = PerceptronConfig
    actor_class: ClassVar[type[GivenDesignActor]] = GivenDesignActor
    actor: GivenDesignActor

    def __init__(self, problem: Problem, config: ConfigType, streams: Streams) -> None:
        super().__init__(problem, config, streams)
        self.make_learner()

    def make_learner(self) -> None:
        """Make an actor, a value network and their learner, with weights from the streams."""
        problem, config, streams = self.problem, self.config, self.streams
        self.actor = self.actor_class(problem.task, config, streams["policy weights"])
        value = MLPValue(problem.task, config.value_net, streams["value weights"])
        self.learner = TwoPhaseLearner(problem, config, streams, self.actor, value, self.give_designs)

    @classmethod
    def small(cls) -> Mapping[str, Any]:
        """Return batches of a few episodes and small networks."""
        return {**SMALL_PPO, **SMALL_PERCEPTRONS}

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Settings:
        """Return PPO's settings."""
        return ppo_settings(profile, task_name)

    def give_designs(self, explorer: Explorer, steps: int, slots: int) -> tuple[Explorer, int]:
        """Return an explorer with the designs of the batch to come, and its number of slots; see `GiveDesigns`.

        By default every episode draws its design uniformly.
        """
        return UniformDesigns(explorer), slots

    @classmethod
    def make_policy(cls, task: Task, config: ConfigType, tensors: Mapping[str, Any]) -> Policy:
        """Return the design and the controller with the given parameters."""
        actor = cls.actor_class(task, config, np.random.default_rng(0))
        load_module_arrays(actor, tensors)
        return ActorPolicy(actor)
