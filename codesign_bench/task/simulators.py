"""Keep a task's simulator between batches and evaluations instead of making it anew.

Making a simulator may be slow (worlds, compiled kernels), and holding two may need too much memory (a 3D world takes
28 MB). So training and evaluation share one: whoever needs it borrows it for as long as its episodes last.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from codesign_bench.task.simulator import Simulator
from codesign_bench.task.task import Task


class Simulators:
    """Lends simulators of one task; between loans it keeps a single one, the widest so far.

    A borrower gets at least as many slots as it asked for. That changes no episode: what happens in a slot depends only
    on what was sent to it since its `begin`, whatever was played in it before.
    """

    def __init__(self, task: Task) -> None:
        self.task = task
        self._idle: Simulator | None = None

    @contextmanager
    def lend(self, num_slots: int) -> Iterator[Simulator]:
        """Lend a simulator with at least `num_slots` slots, which must not be used after the `with` block.

        A second loan within the first gets another simulator.
        """
        simulator = self._take(num_slots)
        yield simulator
        self._keep(simulator)  # Not after an error, which may have left it half-way through a step.

    def _take(self, num_slots: int) -> Simulator:
        idle, self._idle = self._idle, None
        if idle is not None and idle.num_slots >= num_slots:
            return idle
        del idle  # Before the wider one is made: both together could be too much for the memory.
        return self.task.make_simulator(num_slots)

    def _keep(self, simulator: Simulator) -> None:
        if self._idle is None or self._idle.num_slots < simulator.num_slots:
            self._idle = simulator

    def __reduce__(self) -> tuple[type[Simulators], tuple[Task]]:
        """Pickle without the simulator: another process makes its own."""
        return Simulators, (self.task,)
