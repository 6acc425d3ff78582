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
from codesign_bench.task import Floats, Singles, Task
from codesign_bench.task.plans import controls_of, designs_of, plan_size

from ._open_loop import play, step_of
from ._settings import Tuned, tuned, tuned_for

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
TUNED_BY_TASK: Mapping[str, Mapping[str, Any]] = {
    "push": {"popsize": 11, "sigma0": 0.05, "episodes_per_candidate": 1},
    "catch_balls": {"popsize": 23, "sigma0": 0.337, "episodes_per_candidate": 2},
}
"""Those that the common search found; on the other tasks it has not been run (`results/TUNING.md`)."""


class OpenLoopPolicy(Policy):
    """One design and one control per time step; only the elapsed time is read from the observation."""

    def __init__(self, task: Task, plan: Floats) -> None:
        self.task = task
        self.plan = np.asarray(plan, dtype=np.float64)
        self.designs: Singles = designs_of(task, self.plan).astype(np.float32)
        self.controls: Singles = controls_of(task, self.plan).astype(np.float32)

    def design(self, observation: Singles) -> Singles:
        """Return the design, the same for every observation."""
        return np.broadcast_to(self.designs, (*np.shape(observation)[:-1], self.designs.size)).copy()

    def act(self, observation: Singles) -> Singles:
        """Return the control for the elapsed time in the observation."""
        controls: Singles = self.controls[step_of(self.task, observation)]
        return controls

    def tensors(self) -> dict[str, Any]:
        """Return the vector that CMA-ES optimises."""
        return {PLAN: self.plan.copy()}


class CmaEs(Method[Config]):
    """CMA-ES over one design and one open-loop control sequence."""

    name = "cma_es"
    label = "CMA-ES"
    tool_per_goal = False
    config_class = Config

    def __init__(self, problem: Problem, config: Config, streams: Streams) -> None:
        super().__init__(problem, config, streams)
        self.evolution = Evolution(plan_size(problem.task), config, streams["plans"])

    @classmethod
    def small(cls) -> Mapping[str, Any]:
        """Return generations of a few episodes."""
        return {"popsize": 4, "episodes_per_candidate": 1}

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Settings:
        """Return the settings tuned for this baseline."""
        return {**tuned(profile, TUNED), **tuned_for(profile, task_name, TUNED_BY_TASK)}

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
        played = play(self.problem, plans[owner], instances[instance])
        return played.returns.reshape(count, repeats), int(played.steps.sum()), float(played.solved.mean())

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
