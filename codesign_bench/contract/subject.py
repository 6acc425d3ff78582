"""A method on a task, small enough to be asked about many batches.

Shapes: `B` batch, `O` observation, `D` design, `C` control.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from codesign_bench.contract.check import Fault
from codesign_bench.method import Array, Method, Policy, Problem
from codesign_bench.seeding import Streams
from codesign_bench.task import Simulator, Singles, Task
from codesign_bench.task.episodes import Episodes

BUDGET = 10_000
"""Environment steps that are left when a batch is asked for."""
OBSERVATIONS = 6


@dataclass(frozen=True)
class Subject:
    """A method's class, and the task on which it is examined."""

    method_class: type[Method[Any]]
    task: Task

    def make(self, seed: int = 0, task: Task | None = None) -> Method[Any]:
        """Return the method with its small settings, untrained."""
        config = replace(self.method_class.config_class(), **self.method_class.small())
        return self.method_class(Problem(self.task if task is None else task), config, Streams(seed))

    def trained(self, seed: int = 0, batches: int = 1) -> Method[Any]:
        """Return the method after a few batches."""
        method = self.make(seed)
        for _ in range(batches):
            method.train(BUDGET)
        return method

    def observations(self) -> tuple[Singles, Singles]:
        """Return random observations (B, O) of the design and of the control phase."""
        rng, layout, episodes = np.random.default_rng(11), self.task.layout, Episodes(self.task, OBSERVATIONS)
        slots = np.arange(OBSERVATIONS)
        episodes.begin(slots, self.task.sample_instances(rng, OBSERVATIONS))
        designing = episodes.observation.copy()
        episodes.design(slots, rng.uniform(-1.0, 1.0, size=(OBSERVATIONS, self.task.design_space.size)))
        controlling = episodes.observation.copy()
        controlling[:, layout.state] = self.task.state_space.sample(rng, OBSERVATIONS)
        controlling[:, layout.phase.stop - 1] = np.arange(OBSERVATIONS) / self.task.horizon
        return designing, controlling

    def phases(self, policy: Policy) -> Iterator[tuple[str, Callable[[Singles], Singles], Singles, int]]:
        """Yield each phase's name, the policy's function, observations (B, O), and the size of an action."""
        designing, controlling = self.observations()
        yield "design", policy.design, designing, self.task.design_space.size
        yield "control", policy.act, controlling, self.task.control_space.size

    def acting_unlike(self, first: Policy, second: Policy, what: str) -> Iterator[Fault]:
        """Yield in which phase two policies act differently on the same observations."""
        pairs = zip(self.phases(first), self.phases(second), strict=True)
        for (phase, choose, seen, _), (_, other, _, _) in pairs:
            if not np.array_equal(choose(seen), other(seen)):
                yield Fault(f"{what} gives another {phase}", "the same one to the last bit")


class CountingTask:
    """A task of the same kind whose simulators count the environment steps they take."""

    def __init__(self, task: Task) -> None:
        self.env_steps = 0
        self.task = type(task)()
        make = self.task.make_simulator
        # The method asks the task for simulators itself, so they can be counted only there.
        self.task.make_simulator = lambda *arguments: self._counting(make(*arguments))  # type: ignore[method-assign]

    def _counting(self, simulator: Simulator) -> Simulator:
        for name in ("build", "step"):
            setattr(simulator, name, self._counted(getattr(simulator, name)))
        return simulator

    def _counted(self, call: Callable[[Array, Array], None]) -> Callable[[Array, Array], None]:
        def count(slots: Array, values: Array) -> None:
            self.env_steps += len(slots)
            call(slots, values)

        return count


def unlike(first: dict[str, Array], second: dict[str, Array]) -> list[str]:
    """Return the names of arrays that are in one of two collections only, or differ in a bit."""
    names = [*first, *(name for name in second if name not in first)]
    return [name for name in names if name not in first or name not in second or not _same(first[name], second[name])]


def _same(first: Array, second: Array) -> bool:
    return np.shape(first) == np.shape(second) and np.array_equal(
        first, second, equal_nan=np.asarray(first).dtype.kind == "f"
    )


def differing_state(first: Method[Any], second: Method[Any]) -> list[str]:
    """Return the names of what differs between the states of two methods."""
    a, b = first.state(), second.state()
    values = [name for name in {**a.values, **b.values} if a.values.get(name) != b.values.get(name)]
    return [*values, *unlike(a.arrays, b.arrays), *unlike(a.large, b.large)]
