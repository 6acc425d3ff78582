"""The learning problem that a method gets.

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
    """The learning problem: a task, optionally with held-out instances, the trade-off reward or a set of instances."""

    task: Task
    cutout: float = 0.0
    """Fraction of the training region that is held out of training."""
    tradeoff: Tradeoff | None = None
    instances: Floats | None = None
    """(k, I) the only instances for training and evaluation; None: the task's instances."""
    validation: bool = False
    """Whether the method is evaluated on the task's validation instances, on which settings are chosen."""

    @cached_property
    def simulators(self) -> Simulators:
        """The task's simulators in this process, shared by training and evaluation."""
        return Simulators(self.task)

    @contextmanager
    def episodes(self, num_slots: int, simulators: Simulators | None = None) -> Iterator[Episodes]:
        """Lend episodes of the task with at least `num_slots` slots for the duration of the `with` block.

        Args:
            num_slots: slots to lend at least.
            simulators: lend the simulator; None: those shared by training and evaluation.
        """
        with (self.simulators if simulators is None else simulators).lend(num_slots) as simulator:
            yield Episodes(self.task, num_slots, self.tradeoff, simulator)

    def sample_instances(self, rng: np.random.Generator, count: int) -> Floats:
        """Return (count, I) training instances, none of them in the cutout region."""
        if self.instances is not None:
            return self.instances[rng.integers(len(self.instances), size=count)]
        instances = self.task.sample_instances(rng, count)
        # Redrawing only the excluded rows is rejection sampling: the result has the task's distribution, restricted to
        # what is outside of the cutout, for a cutout of any shape.
        if self.cutout > 0.0:
            excluded = self.task.in_cutout(instances, self.cutout)
            while excluded.any():
                instances[excluded] = self.task.sample_instances(rng, int(excluded.sum()))
                excluded = self.task.in_cutout(instances, self.cutout)
        return instances

    def evaluation_instances(self) -> Floats:
        """Return the (N, I) instances on which the method is evaluated."""
        if self.instances is not None:
            return self.instances
        return self.task.validation_instances() if self.validation else self.task.evaluation_instances()
