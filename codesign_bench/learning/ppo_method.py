"""Base classes of methods with a two-phase PPO learner; subclasses of `PPOMethod` define only the networks."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, TypeVar

import numpy as np

from codesign_bench.learning.actor import Actor, ActorPolicy
from codesign_bench.learning.checkpointing import load_module_arrays
from codesign_bench.learning.ppo_config import PPOConfig
from codesign_bench.learning.two_phase import TwoPhaseLearner
from codesign_bench.learning.value_networks import ValueNetwork
from codesign_bench.method import BatchReport, Method, Policy, Problem, State
from codesign_bench.seeding import Streams
from codesign_bench.task import Task

ConfigType = TypeVar("ConfigType", bound=PPOConfig)


class TwoPhaseMethod(Method[ConfigType]):
    """A method that trains a two-phase learner; subclasses make the learner."""

    learner: TwoPhaseLearner

    def use_cores(self, count: int) -> None:
        """Use up to `count` cores."""
        self.learner.use_cores(count)

    def use_device(self, name: str) -> None:
        """Update the networks on the device `name`."""
        self.learner.use_device(name)

    def train(self, remaining_steps: int) -> BatchReport:
        """Collect one batch of whole episodes and update all networks on it."""
        return self.learner.train(remaining_steps)[0]

    def policy(self) -> Policy:
        """Return the actor acting with its means."""
        return self.learner.policy()

    def state(self) -> State:
        """Return the learner's state."""
        return self.learner.state()

    def load_state(self, state: State) -> None:
        """Restore the learner's state."""
        self.learner.load_state(state)


class PPOMethod(TwoPhaseMethod[ConfigType]):
    """A PPO-based method without its networks."""

    config_class: ClassVar[type] = PPOConfig
    learner_class: ClassVar[type[TwoPhaseLearner]] = TwoPhaseLearner

    def __init__(self, problem: Problem, config: ConfigType, streams: Streams) -> None:
        super().__init__(problem, config, streams)
        actor = self.make_actor(problem.task, config, streams["policy weights"])
        value = self.make_value(problem.task, config, streams["value weights"])
        self.learner = self.learner_class(problem, config, streams, actor, value)

    @classmethod
    @abstractmethod
    def make_actor(cls, task: Task, config: ConfigType, rng: np.random.Generator) -> Actor:
        """Return a new designer and controller with weights from `rng`."""

    @classmethod
    @abstractmethod
    def make_value(cls, task: Task, config: ConfigType, rng: np.random.Generator) -> ValueNetwork:
        """Return a new value network with weights from `rng`."""

    def start_from(self, tensors: Mapping[str, Any]) -> None:
        """Start from a trained designer and controller with new value networks."""
        load_module_arrays(self.learner.actor, tensors)

    @classmethod
    def make_policy(cls, task: Task, config: ConfigType, tensors: Mapping[str, Any]) -> Policy:
        """Return the policy of an actor with the given parameters."""
        actor = cls.make_actor(task, config, np.random.default_rng(0))
        load_module_arrays(actor, tensors)
        return ActorPolicy(actor)
