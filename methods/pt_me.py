"""Parametric-task MAP-Elites: an archive of the best design and open-loop controls for many goals, and no network.

Source: "Parametric-Task MAP-Elites" (Anne and Mouret, GECCO 2024, 2402.01275). It asks whether a tool for each goal
needs reinforcement learning. Two things differ from the source: neighbours are the nearest cells instead of a Delaunay
triangulation, which is out of reach where contexts have many numbers, and the policy is the archive itself instead of a
network distilled from it (both ours).

Shapes: `N` cells, `n` evaluations of a batch, `c` numbers of a context, `X` numbers of a plan, `I` instance,
`O` observation, `D` design, `C` control.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from scipy.spatial import KDTree

from codesign_bench.config.search import Integer, LogUniform, Uniform
from codesign_bench.config.settings import Settings
from codesign_bench.config.validation import check_values
from codesign_bench.config.values import Share, Within
from codesign_bench.method import BatchReport, Method, Policy, Problem, State
from codesign_bench.seeding import Streams
from codesign_bench.task import Booleans, Box, Floats, Singles, Slots, Task
from codesign_bench.task.plans import controls_of, designs_of, plan_size

from ._open_loop import play, step_of
from ._settings import Tuned, tuned

NEAREST_OF = (1, 5, 10, 50)
"""Numbers of drawn instances of which a child takes the one nearest to its parent; UCB1 chooses (source)."""


@dataclass(frozen=True, kw_only=True)
class Config:
    """Hyperparameters of `pt_me`."""

    cells: Annotated[int, Within(2, 100_000)] = field(default=200, metadata={"search": Integer(50, 500, log=True)})
    """Cells of the archive, around contexts drawn like those of training."""
    neighbours: Annotated[int, Within(1, 1_000)] = field(default=8, metadata={"search": Integer(3, 20)})
    """Nearest cells whose elites a regression uses."""
    regression_share: Share = field(default=0.5, metadata={"search": Uniform(0.2, 0.8)})
    """Share of children that a regression makes; the others are crossings."""
    crossing_eta: Annotated[float, Within(0.1, 1_000.0)] = field(
        default=10.0, metadata={"search": LogUniform(2.0, 50.0)}
    )
    """Index of simulated binary crossover: larger, nearer to the parents."""
    batch_episodes: Annotated[int, Within(1, 100_000)] = field(default=48, metadata={"search": Integer(16, 128)})
    """Episodes between two updates of the archive."""

    def __post_init__(self) -> None:
        check_values(self)


TUNED: Tuned = {
    "laptop": {"cells": 136, "neighbours": 7, "regression_share": 0.4797, "crossing_eta": 5.47, "batch_episodes": 68},
    "quick": {"cells": 50},
}
"""Settings tuned for this method (ours): those of `laptop` by the common search (results/TUNING.md)."""


def scaled(values: Floats, *boxes: Box) -> Floats:
    """Return values (n, entries of all boxes) scaled to [-1, 1] by the bounds."""
    low, high = (np.concatenate([getattr(box, end) for box in boxes]) for end in ("low", "high"))
    half = np.where(high > low, 0.5 * (high - low), 1.0)  # an entry may be the same for all
    result: Floats = (values - 0.5 * (low + high)) / half
    return result


def contexts_of(task: Task, observation: Singles) -> Floats:
    """Return what a designer sees, the scaled state and goal (n, c), in observations (n, O) of the design step."""
    seen = np.asarray(observation, dtype=np.float64)[:, : task.layout.goal.stop]
    return scaled(seen, task.state_space, task.goal_space)


class ArchivePolicy(Policy):
    """For each observation the design of the nearest elite, and the controls of the elite with the design it sees."""

    def __init__(self, task: Task, contexts: Floats, plans: Floats) -> None:
        self.task, self.contexts, self.plans = task, contexts, plans
        self._designs: Singles = designs_of(task, plans).astype(np.float32)
        self._controls: Singles = controls_of(task, plans).astype(np.float32)
        self._by_context, self._by_design = KDTree(contexts), KDTree(self._designs)

    def design(self, observation: Singles) -> Singles:
        """Return the design of the elite whose context is nearest."""
        batch = np.atleast_2d(observation)
        designs: Singles = self._designs[self._by_context.query(contexts_of(self.task, batch))[1]]
        return designs if np.ndim(observation) == 2 else designs[0]

    def act(self, observation: Singles) -> Singles:
        """Return the control for the elapsed time of the elite whose design is nearest to the observed one."""
        # The context of the start is no longer seen: the state has moved on. The design has not.
        batch = np.atleast_2d(observation)
        elite = self._by_design.query(batch[:, self.task.layout.design])[1]
        controls: Singles = self._controls[elite, step_of(self.task, batch)]
        return controls if np.ndim(observation) == 2 else controls[0]

    def tensors(self) -> dict[str, Any]:
        """Return contexts and plans of all elites."""
        return {"contexts": self.contexts.copy(), "plans": self.plans.copy()}


@dataclass(frozen=True)
class Children:
    """Plans to be tried, each on its instance."""

    instances: Floats
    """(n, I)"""
    plans: Floats
    """(n, X)"""
    arm: Slots
    """(n,) which of `NEAREST_OF` chose the instance; -1: none, it is the first drawn."""


@dataclass
class Archive:
    """The best plan of each cell, with its instance and what was observed there."""

    cells: Floats
    """(N, I) scaled instances at the middle of the cells."""
    instances: Floats
    """(N, I) scaled instances of the elites."""
    contexts: Floats
    """(N, c)"""
    plans: Floats
    """(N, X)"""
    returns: Floats
    """(N,); minus infinity where there is no elite yet."""

    @property
    def filled(self) -> Booleans:
        """(N,) which cells have an elite."""
        return np.isfinite(self.returns)

    def replace(self, instances: Floats, plans: Floats, returns: Floats, contexts: Floats) -> Booleans:
        """Put each plan in its instance's cell if it is better than the elite there; return which were (n,)."""
        better = np.zeros(len(returns), dtype=bool)
        for index, cell in enumerate(np.asarray(KDTree(self.cells).query(instances)[1])):
            if returns[index] > self.returns[cell]:
                better[index], self.returns[cell] = True, returns[index]
                self.instances[cell], self.plans[cell] = instances[index], plans[index]
                self.contexts[cell] = contexts[index]
        return better


class PtMe(Method[Config]):
    """An archive over goals of a design and open-loop controls."""

    name = "pt_me"
    label = "PT-ME"
    config_class = Config

    def __init__(self, problem: Problem, config: Config, streams: Streams) -> None:
        super().__init__(problem, config, streams)
        self._rng, task = streams["archive"], problem.task
        cells = self._scaled(problem.sample_instances(streams["cells"], config.cells))
        context = task.state_space.size + task.goal_space.size
        self.archive = Archive(
            cells,
            cells.copy(),
            np.zeros((config.cells, context)),
            np.zeros((config.cells, plan_size(task))),
            np.full(config.cells, -np.inf),
        )
        self._pulls, self._wins = np.zeros(len(NEAREST_OF)), np.zeros(len(NEAREST_OF))

    def _scaled(self, instances: Floats) -> Floats:
        return scaled(instances, self.problem.task.instance_space)

    @classmethod
    def small(cls) -> Mapping[str, Any]:
        """Return a small archive and few episodes."""
        return {"cells": 8, "neighbours": 3, "batch_episodes": 4}

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Settings:
        """Return the settings tuned for this method."""
        return tuned(profile, TUNED)

    def train(self, remaining_steps: int) -> BatchReport:
        """Play a batch of children, and put those that are better than the elite of their cell in its place."""
        longest = self.problem.task.horizon + 1
        count = max(1, min(self.config.batch_episodes, remaining_steps // longest))
        children = self._children(count) if self.archive.filled.sum() > 1 else self._first(count)
        played = play(self.problem, children.plans, children.instances)
        contexts = contexts_of(self.problem.task, played.starts)
        instances = self._scaled(children.instances)
        better = self.archive.replace(instances, children.plans, played.returns, contexts)
        for arm in range(len(NEAREST_OF)):
            self._pulls[arm] += (children.arm == arm).sum()
            self._wins[arm] += better[children.arm == arm].sum()
        metrics = {
            "train_return": float(played.returns.mean()),
            "train_success": float(played.solved.mean()),
            "archive_return": float(self.archive.returns[self.archive.filled].mean()),
            "archive_filled": float(self.archive.filled.mean()),
            "improved": float(better.mean()),
        }
        return BatchReport(int(played.steps.sum()), metrics)

    def _drawn(self, count: int) -> Floats:
        return self.problem.sample_instances(self.streams["instances"], count)

    def _first(self, count: int) -> Children:
        """Return uniform plans, while there are no elites."""
        plans = self._rng.uniform(-1.0, 1.0, (count, self.archive.plans.shape[1]))
        return Children(self._drawn(count), plans, np.full(count, -1))

    def _children(self, count: int) -> Children:
        """Return plans made from the elites, by regression at the instance or by crossing two."""
        archive, crossing = self.archive, self._rng.random(count) >= self.config.regression_share
        instances, plans = self._drawn(count), np.empty((count, archive.plans.shape[1]))
        plans[~crossing] = self._regressed(self._scaled(instances[~crossing]))
        parents = self._rng.choice(np.flatnonzero(archive.filled), (int(crossing.sum()), 2))
        plans[crossing] = self._crossed(archive.plans[parents[:, 0]], archive.plans[parents[:, 1]])
        arm = self._arm()
        # A crossing is tried on the instance nearest to its first parent's of several; of how many, UCB1 learns.
        for child, parent in zip(np.flatnonzero(crossing), parents[:, 0], strict=True):
            offered = self._drawn(NEAREST_OF[arm])
            gaps = np.linalg.norm(self._scaled(offered) - archive.instances[parent], axis=1)
            instances[child] = offered[gaps.argmin()]
        return Children(instances, plans, np.where(crossing, arm, -1))

    def _arm(self) -> int:
        """Return the arm with the highest upper confidence bound of its share of improvements (UCB1)."""
        if (self._pulls == 0.0).any():
            return int(np.argmin(self._pulls))
        bound = self._wins / self._pulls + np.sqrt(2.0 * np.log(self._pulls.sum()) / self._pulls)
        return int(np.argmax(bound))

    def _crossed(self, one: Floats, other: Floats) -> Floats:
        """Return simulated binary crossovers (n, X) of plans (n, X) (Deb and Agrawal 1995)."""
        share = self._rng.random(one.shape)
        power = 1.0 / (self.config.crossing_eta + 1.0)
        spread = np.where(share <= 0.5, 2.0 * share, 1.0 / (2.0 * (1.0 - share))) ** power
        return np.clip(0.5 * ((1.0 + spread) * one + (1.0 - spread) * other), -1.0, 1.0)

    def _regressed(self, instances: Floats) -> Floats:
        """Return plans (n, X) of a linear regression on the elites around scaled instances (n, I), with noise."""
        archive = self.archive
        plans = np.empty((len(instances), archive.plans.shape[1]))
        nearest = range(1, min(self.config.neighbours, len(archive.cells)) + 1)
        around = np.asarray(KDTree(archive.cells).query(instances, k=nearest)[1]) if len(instances) else instances
        for place, (instance, cells) in enumerate(zip(instances, around, strict=True)):
            elites = cells[archive.filled[cells]] if archive.filled[cells].any() else np.flatnonzero(archive.filled)
            known = np.column_stack([np.ones(len(elites)), archive.instances[elites]])
            line = np.linalg.lstsq(known, archive.plans[elites], rcond=None)[0]
            noise = self._rng.standard_normal(plans.shape[1]) * archive.plans[elites].std(axis=0)
            plans[place] = np.clip(np.concatenate([[1.0], instance]) @ line + noise, -1.0, 1.0)
        return plans

    def policy(self) -> Policy:
        """Return the archive as a policy: its elites, or the middle design at rest before there are any."""
        chosen = self.archive.filled if self.archive.filled.any() else np.arange(1)
        return ArchivePolicy(self.problem.task, self.archive.contexts[chosen], self.archive.plans[chosen])

    @classmethod
    def make_policy(cls, task: Task, config: Config, tensors: Mapping[str, Any]) -> Policy:
        """Return the policy of an archive."""
        return ArchivePolicy(task, np.array(tensors["contexts"]), np.array(tensors["plans"]))

    def state(self) -> State:
        """Return the archive and what UCB1 has counted."""
        arrays = {**vars(self.archive), "pulls": self._pulls, "wins": self._wins}
        return State({name: array.copy() for name, array in arrays.items()}, {})

    def load_state(self, state: State) -> None:
        """Restore the archive and what UCB1 has counted."""
        arrays = {name: np.array(array) for name, array in state.arrays.items()}
        self._pulls, self._wins = arrays.pop("pulls"), arrays.pop("wins")
        self.archive = Archive(**arrays)
