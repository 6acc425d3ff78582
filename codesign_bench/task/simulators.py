"""Reuse a task's simulator across batches and evaluations, and share work among processes with a simulator each.

Making a simulator may be slow (worlds, compiled kernels), and two may need too much memory (a 3D world takes 28 MB).
Training and evaluation therefore share one: each borrows it while its episodes run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import TypeVar

from codesign_bench.task.simulator import Simulator
from codesign_bench.task.task import Task
from codesign_bench.task.workers import Workers

Part = TypeVar("Part")
Result = TypeVar("Result")


class Simulators:
    """Lends simulators of one task; between loans it keeps only the widest one so far.

    A borrower gets at least the requested number of slots. Extra slots do not change an episode: what happens in a slot
    depends only on the calls to it since its `begin`.
    """

    def __init__(self, task: Task) -> None:
        self.task = task
        self._idle: Simulator | None = None
        self._workers: Workers[Simulators] | None = None

    def use_cores(self, count: int) -> None:
        """Share work among up to `count` processes from now on; by default this process does all of it."""
        if count != (1 if self._workers is None else self._workers.count):
            self._workers = Workers(partial(Simulators, self.task), count) if count > 1 else None

    def share(self, work: Callable[[Simulators, Part], Result], parts: Sequence[Part]) -> list[Result]:
        """Return what `work` returns for every one of `parts`, in their order.

        In another process it gets other simulators, and a copy of its part.
        """
        if self._workers is None or len(parts) < 2:
            return [work(self, part) for part in parts]
        return self._workers.map(work, parts)

    @contextmanager
    def lend(self, num_slots: int) -> Iterator[Simulator]:
        """Lend a simulator with at least `num_slots` slots; it must not be used after the `with` block.

        A nested loan gets another simulator.
        """
        simulator = self._take(num_slots)
        yield simulator
        self._keep(simulator)  # not after an error, which may leave it in the middle of a step

    def _take(self, num_slots: int) -> Simulator:
        idle, self._idle = self._idle, None
        if idle is not None and idle.num_slots >= num_slots:
            return idle
        del idle  # freed before the wider one is made, because both may not fit in memory
        return self.task.make_simulator(num_slots)

    def _keep(self, simulator: Simulator) -> None:
        if self._idle is None or self._idle.num_slots < simulator.num_slots:
            self._idle = simulator

    def __reduce__(self) -> tuple[type[Simulators], tuple[Task]]:
        """Pickle without the simulator; another process makes a new one."""
        return Simulators, (self.task,)
