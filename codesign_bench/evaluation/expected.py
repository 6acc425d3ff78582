"""What playing many episodes will take, before it begins: at most so many, and how long, by the speed of a few."""

from __future__ import annotations

import time
from dataclasses import dataclass

from codesign_bench.console import duration
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.machine import available_cores
from codesign_bench.seeding import generator
from codesign_bench.task import EVALUATION_SEED, Task
from codesign_bench.task.behaviours import RandomBehaviour

TIMED = 16
"""Episodes that are played to know the speed."""


@dataclass(frozen=True)
class Work:
    """Episodes that will be played on a task."""

    task: Task
    episodes: int
    """At most."""
    steps_per_second: float
    """Environment steps of a process."""
    jobs: int = 1
    """Processes that play side by side."""

    @property
    def env_steps(self) -> int:
        """Environment steps at most: each episode has its design step and the whole horizon."""
        return self.episodes * (self.task.horizon + 1)

    @property
    def seconds(self) -> float:
        """How long it takes at most."""
        return self.env_steps / self.steps_per_second / max(1, min(self.jobs, available_cores()))

    def line(self) -> str:
        """Return it as text."""
        return f"at most {self.episodes:,} episodes, {self.env_steps:,} environment steps, {duration(self.seconds)}"


def steps_per_second(task: Task) -> float:
    """Return how many environment steps a process plays per second, measured on a few random episodes."""
    behaviour = RandomBehaviour(task, generator(EVALUATION_SEED, f"speed of {task.name}"))
    began = time.perf_counter()
    found = evaluate(task, behaviour, instances=task.evaluation_instances()[:TIMED])
    return float(found.lengths.sum() + len(found.lengths)) / max(time.perf_counter() - began, 1e-9)
