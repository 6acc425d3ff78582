"""Single-trajectory baseline: CMA-ES over one design and one open-loop control sequence, independent of the goal.

Source: the paper, section "Evaluating sample efficiency" and its table of baseline hyperparameters: "a set of design
and control actions for an episode independent of the goal or starting task state".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from codesign_bench.config.search import Integer
from codesign_bench.config.settings import Settings
from codesign_bench.config.values import Within
from codesign_bench.learning.cma_es import Evolution, EvolutionConfig, fitness_metrics
from codesign_bench.method import BatchReport, Method, Policy, Problem, State
from codesign_bench.seeding import Streams
from codesign_bench.task import Booleans, Floats, Singles, Task
from codesign_bench.task.episodes import portions

from ._settings import Tuned, tuned

PLAN = "plan"


@dataclass(frozen=True, kw_only=True)
class Config(EvolutionConfig):
    """Hyperparameters of `cma_es`."""

    episodes_per_candidate: Annotated[int, Within(1, 10_000)] = field(
        default=4, metadata={"source": "ours; the paper is silent", "search": Integer(1, 32, log=True)}
    )
    """Number of instances over which a candidate's return is averaged, the same for all candidates of a generation."""


TUNED: Tuned = {"laptop": {"sigma0": 0.3, "episodes_per_candidate": 16}, "quick": {}}
"""Settings tuned for this baseline (ours)."""


class OpenLoopPolicy(Policy):
    """One design and one control per time step; only the elapsed time is read from the observation."""

    def __init__(self, task: Task, plan: Floats) -> None:
        size = task.design_space.size
        self.task = task
        self.plan = np.asarray(plan, dtype=np.float64)
        self.designs: Singles = self.plan[:size].astype(np.float32)
        self.controls: Singles = self.plan[size:].reshape(task.horizon, task.control_space.size).astype(np.float32)

    def design(self, observation: Singles) -> Singles:
        """Return the design, the same for every observation."""
        return np.broadcast_to(self.designs, (*np.shape(observation)[:-1], self.designs.size)).copy()

    def act(self, observation: Singles) -> Singles:
        """Return the control for the elapsed time in the observation."""
        elapsed = np.asarray(observation)[..., self.task.layout.phase.stop - 1]
        # The elapsed fraction is stored in single precision, so it is rounded to the nearest step, not down.
        step = np.minimum(np.rint(elapsed * self.task.horizon).astype(int), self.task.horizon - 1)
        controls: Singles = self.controls[step]
        return controls

    def tensors(self) -> dict[str, Any]:
        """Return the vector that CMA-ES optimises."""
        return {PLAN: self.plan.copy()}


class CmaEs(Method[Config]):
    """CMA-ES over one design and one open-loop control sequence."""

    name = "cma_es"
    label = "CMA-ES"
    config_class = Config

    def __init__(self, problem: Problem, config: Config, streams: Streams) -> None:
        super().__init__(problem, config, streams)
        task = problem.task
        size = task.design_space.size + task.horizon * task.control_space.size
        self.evolution = Evolution(size, config, streams["plans"])

    @classmethod
    def small(cls) -> Mapping[str, Any]:
        """Return generations of a few episodes."""
        return {"popsize": 4, "episodes_per_candidate": 1}

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Settings:
        """Return the settings tuned for this baseline."""
        return tuned(profile, TUNED)

    @property
    def shortest_batch(self) -> int:
        """One episode per candidate, since candidates are compared on the same instances."""
        return self.config.popsize * super().shortest_batch

    def train(self, remaining_steps: int) -> BatchReport:
        """Evaluate one generation: every candidate on the same few instances, with the mean return as its fitness.

        At the end of the budget a generation plays fewer instances, but every candidate plays at least one.
        """
        config, problem = self.config, self.problem
        plans = self.evolution.ask()
        affordable = remaining_steps // (config.popsize * (problem.task.horizon + 1))
        # All candidates get the same number of instances, and the same ones: CMA-ES uses only the ranking of
        # candidates, which the luck of easier instances would distort.
        repeats = max(1, min(config.episodes_per_candidate, affordable))
        instances = problem.sample_instances(self.streams["instances"], repeats)
        returns, steps, solved = self._play(plans, instances)
        fitness = returns.mean(axis=1)
        self.evolution.tell(fitness)
        metrics = {
            "train_return": float(fitness.mean()),
            "train_best_return": float(fitness.max()),
            "train_success": solved,
            **fitness_metrics(returns),
            **self.evolution.metrics(),
        }
        return BatchReport(steps, metrics)

    def _play(self, plans: Floats, instances: Floats) -> tuple[Floats, int, float]:
        """Return returns (P, instances), simulated steps and success rate of all plans (P, X) on all instances."""
        count, repeats = len(plans), len(instances)
        owner, instance = np.repeat(np.arange(count), repeats), np.tile(np.arange(repeats), count)
        parts = [
            self._play_each(plans[owner[part]], instances[instance[part]])
            for part in portions(len(owner), self.problem.task)
        ]
        returns, steps, solved = (np.concatenate(values) for values in zip(*parts, strict=True))
        return returns.reshape(count, repeats), int(steps.sum()), float(solved.mean())

    def _play_each(self, plans: Floats, instances: Floats) -> tuple[Floats, Floats, Booleans]:
        """Return returns, simulated steps and successes, (b,) each, of plans (b, X) on one instance (b, I) each."""
        task, slots = self.problem.task, np.arange(len(plans))
        size = task.design_space.size
        controls = plans[:, size:].reshape(len(slots), task.horizon, task.control_space.size)
        returns, steps, active = np.zeros(len(slots)), np.ones(len(slots)), slots
        with self.problem.episodes(len(slots)) as episodes:
            episodes.begin(slots, instances)
            episodes.design(slots, plans[:, :size])
            for step in range(task.horizon):
                reward, terminated, truncated = episodes.control(active, controls[active, step])
                returns[active] += reward
                steps[active] += 1.0
                active = active[~(terminated | truncated)]
                if not active.size:
                    break
            return returns, steps, episodes.success(slots).copy()

    def policy(self) -> Policy:
        """Return the mean of CMA-ES as a policy."""
        return OpenLoopPolicy(self.problem.task, self.evolution.mean)

    @classmethod
    def make_policy(cls, task: Task, config: Config, tensors: Mapping[str, Any]) -> Policy:
        """Return the policy of an optimised vector."""
        return OpenLoopPolicy(task, tensors[PLAN])

    def state(self) -> State:
        """Return the history of CMA-ES."""
        return State({"evolution.history": np.array(self.evolution.history).reshape(-1, self.config.popsize)}, {})

    def load_state(self, state: State) -> None:
        """Repeat the generations of CMA-ES."""
        self.evolution.replay(state.arrays["evolution.history"])
