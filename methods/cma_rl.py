"""Bi-level baseline: CMA-ES over one design outside, PPO for a design-conditioned controller inside.

Source: the paper, section "Evaluating sample efficiency" and its table of baseline hyperparameters. Every PPO batch
plays whole episodes with the candidates of one generation; a candidate's fitness is its mean return in that batch, and
every one of those steps counts.

Shapes: `P` candidates of a generation, `R` rounds of slots, `E` episodes of a slot, `K` instances, `D` design.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Tensor, nn

from codesign_bench.config.settings import Settings
from codesign_bench.learning.actor import Actor, ActorPolicy
from codesign_bench.learning.checkpointing import load_module_arrays
from codesign_bench.learning.cma_es import Evolution, EvolutionConfig, fitness_metrics
from codesign_bench.learning.explorer import Trial
from codesign_bench.learning.features import Features
from codesign_bench.learning.networks import MLP, RunningNorm, torch_generator
from codesign_bench.learning.ppo_config import PerceptronConfig
from codesign_bench.learning.two_phase import TwoPhaseLearner
from codesign_bench.learning.value_networks import MLPValue
from codesign_bench.method import BatchReport, Method, Policy, Problem, State
from codesign_bench.seeding import Streams
from codesign_bench.task import Floats, Task

from ._settings import SMALL_PERCEPTRONS, SMALL_PPO, Tuned, ppo_settings, tuned


@dataclass(frozen=True, kw_only=True)
class Config(EvolutionConfig, PerceptronConfig):
    """Hyperparameters of `cma_rl`: CMA-ES's for the design, PPO's and the perceptrons' for the controller."""

    not_searched: ClassVar = ("design_log_std", "design_learning_rate", "design_epochs", "design_kl_threshold")
    """Without effect here: CMA-ES moves the design."""


TUNED: Tuned = {"laptop": {"sigma0": 0.4}, "quick": {}}
"""Settings tuned for this baseline (ours)."""


class GivenDesignActor(Actor):
    """The design that CMA-ES has found so far, and a perceptron that controls any design."""

    best_design: Tensor

    def __init__(self, task: Task, config: Config, rng: np.random.Generator) -> None:
        super().__init__()
        self.features = Features(task)
        self.norm = RunningNorm.over(*self.features.boxes)
        self.register_buffer("best_design", torch.zeros(task.design_space.size))
        sizes = [self.features.flat_size, *config.policy_net, task.control_space.size]
        self.controller = MLP(sizes, torch_generator(rng), output_scale=0.1)
        self.add_log_stds(
            *(task.design_space.size, task.control_space.size), -np.inf, config.control_log_std, config.fix_std
        )

    def design(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return the best design (B, D) so far, with standard deviation 0."""
        return self.best_design.expand(len(observation), -1), self.design_log_std

    def control(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean (B, C) and log standard deviation (C,) of controls."""
        return self.controller(self.features.flat(observation, self.norm)), self.control_log_std

    def design_parameters(self) -> list[nn.Parameter]:
        """Return no parameters: CMA-ES optimises the design."""
        return []

    def control_parameters(self) -> list[nn.Parameter]:
        """Return the controller's parameters."""
        return [*self.controller.parameters(), self.control_log_std]

    def update_statistics(self, observation: Tensor, is_design: Tensor) -> None:
        """Update the controller's normalisation."""
        self.norm.update(self.features.task(observation[~is_design]))


class CmaRl(Method[Config]):
    """CMA-ES over one design for all goals, with PPO for a design-conditioned controller inside."""

    name = "cma_rl"
    label = "CMA-RL"
    config_class = Config

    def __init__(self, problem: Problem, config: Config, streams: Streams) -> None:
        super().__init__(problem, config, streams)
        self.evolution = Evolution(problem.task.design_space.size, config, streams["designs"])
        self.actor = GivenDesignActor(problem.task, config, streams["policy weights"])
        value = MLPValue(problem.task, config.value_net, streams["value weights"])
        self.learner = TwoPhaseLearner(problem, config, streams, self.actor, value, self._generation)

    @classmethod
    def small(cls) -> Mapping[str, Any]:
        """Return batches of a few episodes and small networks."""
        return {**SMALL_PPO, **SMALL_PERCEPTRONS, "popsize": 4}

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Settings:
        """Return PPO's settings, with those tuned for this baseline."""
        return {**ppo_settings(profile, task_name), **tuned(profile, TUNED)}

    def use_cores(self, count: int) -> None:
        """Use up to `count` cores."""
        self.learner.use_cores(count)

    def use_device(self, name: str) -> None:
        """Update the networks on the device `name`."""
        self.learner.use_device(name)

    def _generation(self, steps: int, slots: int) -> Trial:
        """Give slot after slot the candidates of this generation in turn, in whole rounds of the generation.

        In a round every candidate meets the same instances in the same order: on instances of their own, most of what
        tells candidates apart would be which instances they met.
        """
        popsize = self.config.popsize
        rounds = max(1, slots // popsize)
        slots = min(slots, rounds * popsize)
        most = steps // slots // 2 + 1  # An episode has a design step and a control step at least.
        drawn = self.problem.sample_instances(self.streams["generation's instances"], rounds * most)
        instances = drawn.reshape(rounds, most, -1)[np.arange(slots) // popsize]
        return Trial(self.evolution.ask()[np.arange(slots) % popsize].astype(np.float32), instances)

    def train(self, remaining_steps: int) -> BatchReport:
        """Play a batch with one generation of designs, update the controller on it, and give CMA-ES the returns.

        A last batch that is too small to try every candidate only trains the controller.
        """
        report, batch = self.learner.train(remaining_steps)
        metrics = dict(report.metrics)
        if len(batch.valid) >= self.config.popsize:
            returns = self._on_common_instances(batch.episode_returns)
            self.evolution.tell(returns.mean(axis=1))
            self.actor.best_design.copy_(torch.from_numpy(self.evolution.mean))
            metrics |= fitness_metrics(returns)
        return replace(report, metrics=metrics | self.evolution.metrics())

    def _on_common_instances(self, returns: list[Floats]) -> Floats:
        """Return the returns (P, K) of every candidate on the instances that all candidates have met.

        Episodes that only some slots of a round had time for are left out: they were of whoever ended others sooner.
        """
        popsize = self.config.popsize
        rounds = [returns[first : first + popsize] for first in range(0, len(returns), popsize)]
        common = [min(len(of_slot) for of_slot in slots) for slots in rounds]
        parts = [np.array([of_slot[:count] for of_slot in slots]) for slots, count in zip(rounds, common, strict=True)]
        return np.concatenate(parts, axis=1)

    def policy(self) -> Policy:
        """Return the mean design of CMA-ES with the mean of the controller."""
        return self.learner.policy()

    @classmethod
    def make_policy(cls, task: Task, config: Config, tensors: Mapping[str, Any]) -> Policy:
        """Return the design and the controller with the given parameters."""
        actor = GivenDesignActor(task, config, np.random.default_rng(0))
        load_module_arrays(actor, tensors)
        return ActorPolicy(actor)

    def state(self) -> State:
        """Return the learner's state and the history of CMA-ES."""
        state = self.learner.state()
        history = np.array(self.evolution.history).reshape(-1, self.config.popsize)
        return State(state.arrays | {"evolution.history": history}, state.values)

    def load_state(self, state: State) -> None:
        """Restore the learner's state and repeat the generations of CMA-ES."""
        arrays = dict(state.arrays)
        self.evolution.replay(arrays.pop("evolution.history"))
        self.learner.load_state(State(arrays, state.values))
