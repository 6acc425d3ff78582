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

from codesign_bench.config.settings import Settings
from codesign_bench.learning.cma_es import Evolution, EvolutionConfig, fitness_metrics
from codesign_bench.learning.explorer import Explorer, FixedDesigns, Trial
from codesign_bench.learning.ppo_config import PerceptronConfig
from codesign_bench.method import BatchReport, Problem, State
from codesign_bench.seeding import Streams
from codesign_bench.task import Floats

from ._given_design import WITHOUT_EFFECT, GivenDesignMethod
from ._settings import Tuned, tuned, tuned_for


@dataclass(frozen=True, kw_only=True)
class Config(EvolutionConfig, PerceptronConfig):
    """Hyperparameters of `cma_rl`: CMA-ES's for the design, PPO's and the perceptrons' for the controller."""

    not_searched: ClassVar = WITHOUT_EFFECT
    """CMA-ES moves the design."""


TUNED: Tuned = {"laptop": {"sigma0": 0.4}, "quick": {}}
"""Settings tuned for this baseline (ours)."""
TUNED_BY_TASK: Mapping[str, Mapping[str, Any]] = {
    "push": {
        "batch_size": 6627,
        "minibatch_size": 528,
        "epochs": 9,
        "policy_learning_rate": 8.187e-4,
        "value_learning_rate": 2.083e-4,
        "kl_threshold": 0.1019,
        "control_log_std": -0.2932,
        "gamma": 0.995,
        "gae_lambda": 0.9956,
        "clip_ratio": 0.1538,
        "popsize": 13,
        "sigma0": 0.1675,
    },
}
"""Those of `laptop` that the common search found and that did better than those found by hand (`results/TUNING.md`).

`quick` keeps the latter: the search asks what pays after 1 million steps, and at a fifth of them it is no better.
"""


class CmaRl(GivenDesignMethod[Config]):
    """CMA-ES over one design for all goals, with PPO for a design-conditioned controller inside."""

    name = "cma_rl"
    label = "CMA-RL"
    tool_per_goal = False
    config_class = Config

    def __init__(self, problem: Problem, config: Config, streams: Streams) -> None:
        super().__init__(problem, config, streams)
        self.evolution = Evolution(problem.task.design_space.size, config, streams["designs"])

    @classmethod
    def small(cls) -> Mapping[str, Any]:
        """Return batches of a few episodes and small networks."""
        return {**super().small(), "popsize": 4}

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Settings:
        """Return PPO's settings, with those tuned for this baseline."""
        return {
            **super().profile(profile, task_name),
            **tuned(profile, TUNED),
            **tuned_for(profile, task_name, TUNED_BY_TASK, profiles=("laptop", "workstation")),
        }

    def give_designs(self, explorer: Explorer, steps: int, slots: int) -> tuple[Explorer, int]:
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
        designs = self.evolution.ask()[np.arange(slots) % popsize].astype(np.float32)
        return FixedDesigns(explorer, Trial(designs, instances)), slots

    def train(self, remaining_steps: int) -> BatchReport:
        """Play a batch with one generation of designs, update the controller on it, and give CMA-ES the returns.

        A last batch that is too small to try every candidate only trains the controller.
        """
        report, batch = self.learner.train(remaining_steps)
        metrics = dict(report.metrics)
        if len(batch.valid) >= self.config.popsize:
            returns = self._on_common_instances(batch.episode_returns)
            self.evolution.tell(returns.mean(axis=1))
            self.actor.act_with(self.evolution.mean)
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

    def state(self) -> State:
        """Return the learner's state and the history of CMA-ES."""
        state = super().state()
        history = np.array(self.evolution.history).reshape(-1, self.config.popsize)
        return State(state.arrays | {"evolution.history": history}, state.values)

    def load_state(self, state: State) -> None:
        """Restore the learner's state and repeat the generations of CMA-ES."""
        arrays = dict(state.arrays)
        self.evolution.replay(arrays.pop("evolution.history"))
        super().load_state(State(arrays, state.values))
