"""What a method is asked to learn.

Shapes: `N` evaluation instances, `I` instance.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from codesign_bench.task import Floats, Task
from codesign_bench.task.episodes import Episodes, Tradeoff
from codesign_bench.task.simulators import Simulators


@dataclass(frozen=True)
class Problem:
    """What a method is asked to learn: a task, perhaps with a cutout of its instances and the trade-off reward."""

    task: Task
    cutout: float = 0.0
    """Fraction of the training region whose instances are never trained on."""
    tradeoff: Tradeoff | None = None
    instances: Floats | None = None
    """(k, I) the only instances to train and be judged on, or None: the task's own."""

    @cached_property
    def simulators(self) -> Simulators:
        """The task's simulators in this process, which training and evaluation share."""
        return Simulators(self.task)

    @contextmanager
    def episodes(self, num_slots: int) -> Iterator[Episodes]:
        """Lend episodes of the task with at least `num_slots` slots, for the time of the `with` block."""
        with self.simulators.lend(num_slots) as simulator:
            yield Episodes(self.task, num_slots, self.tradeoff, simulator)

    def sample_instances(self, rng: np.random.Generator, count: int) -> Floats:
        """Return (count, I) training instances: none from the cutout region."""
        if self.instances is not None:
            return self.instances[rng.integers(len(self.instances), size=count)]
        instances = self.task.sample_instances(rng, count)
        if self.cutout > 0.0:
            excluded = self.task.in_cutout(instances, self.cutout)
            while excluded.any():
                instances[excluded] = self.task.sample_instances(rng, int(excluded.sum()))
                excluded = self.task.in_cutout(instances, self.cutout)
        return instances

    def evaluation_instances(self) -> Floats:
        """Return the (N, I) instances on which the method is judged."""
        return self.task.evaluation_instances() if self.instances is None else self.instances
