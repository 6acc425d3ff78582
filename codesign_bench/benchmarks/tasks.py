"""Speed of the tasks on this machine, compared with the bare physics engine: the overhead of the benchmark.

The engine's share is measured within the same run: the time in `Simulator.advance`, which only makes the engine's step
calls.

Shapes: `B` slots, `C` control.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.console import Console

from codesign_bench.console import print_table
from codesign_bench.errors import UserError
from codesign_bench.seeding import generator
from codesign_bench.task import load_task
from codesign_bench.task.episodes import Episodes

SLOTS = 64
HELD_STEPS = 10
"""Random controls are redrawn after this many steps."""
SEED = 0


@dataclass(frozen=True)
class TaskSpeed:
    """Time of random episodes of one task by part, in s."""

    env_steps: int
    """Number of control and design steps."""
    control_steps: int
    engine: float
    """Time in the engine's steps during control steps."""
    control: float
    """Time in control steps, including the engine."""
    starts: float
    """Time in episode starts: scene, design step, and their physics."""

    @property
    def row(self) -> tuple[str, ...]:
        """The cells of the printed table."""
        total = self.control + self.starts
        return (
            f"{self.env_steps / total:,.0f}",
            f"{1e6 * self.control / self.control_steps:.1f}",
            f"{1e6 * self.engine / self.control_steps:.1f}",
            f"{self.control / self.engine:.2f}" if self.engine else "-",
            f"{100.0 * self.starts / total:.0f} %",
        )


HEADER = ("task", "env steps/s", "control step (us)", "engine (us)", "ratio", "episode starts")


def bench_tasks(names: Sequence[str], seconds: float, console: Console) -> None:
    """Print the speed of each of the tasks `names`, measured for about `seconds` each, on one core.

    Raises:
        UserError: an unknown task.
    """
    tasks = {name: load_task(name) for name in names}
    rows = []
    for name in tasks:
        console.print(
            f"{name}: random episodes in {min(SLOTS, tasks[name].max_slots)} slots for {seconds:g} s",
            markup=False,
            highlight=False,
        )
        rows.append((name, *measure_task(name, seconds).row))
    print_table(console, HEADER, rows)
    console.print(
        "control step: one slot's step with action, observation and reward\n"
        "engine: the physics engine's own step calls within it; ratio: the first over the second\n"
        "episode starts: their share of all time; one core, no learning",
        markup=False,
        highlight=False,
    )


def measure_task(name: str, seconds: float, slots: int = SLOTS) -> TaskSpeed:
    """Play random episodes of the task `name` for about `seconds`, at least until every slot has finished one.

    Raises:
        UserError: the time is not positive.
    """
    if seconds <= 0.0:
        raise UserError(f"--seconds must be positive, not {seconds:g}")
    task, rng = load_task(name), generator(SEED, "bench")
    slots = min(slots, task.max_slots)
    episodes = Episodes(task, slots)
    engine, control, starts = _Stopwatch(), _Stopwatch(), _Stopwatch()
    every = np.arange(slots)
    controls = np.zeros((slots, task.control_space.size))
    control_steps = finished = started = 0
    starting = every
    with engine.around(episodes.simulator, "advance"):
        while control.total + starts.total < seconds or finished < slots:
            if starting.size:
                before = engine.total
                with starts.running():
                    episodes.begin(starting, task.sample_instances(rng, starting.size))
                    episodes.design(starting, rng.uniform(-1.0, 1.0, size=(starting.size, task.design_space.size)))
                engine.total = before  # physics during an episode's start counts as part of the start
                started += starting.size
            if control_steps // slots % HELD_STEPS == 0:
                controls = rng.uniform(-1.0, 1.0, size=controls.shape)
            with control.running():
                _, terminated, truncated = episodes.control(every, controls)
            control_steps += slots
            starting = every[terminated | truncated]
            finished += starting.size
    return TaskSpeed(control_steps + started, control_steps, engine.total, control.total, starts.total)


class _Stopwatch:
    """Adds up wall time."""

    def __init__(self) -> None:
        self.total = 0.0

    @contextmanager
    def running(self) -> Iterator[None]:
        begin = time.perf_counter()
        try:
            yield
        finally:
            self.total += time.perf_counter() - begin

    @contextmanager
    def around(self, owner: Any, name: str) -> Iterator[None]:
        """Measure every call of the method `name` of `owner`."""
        method: Callable[..., Any] = getattr(owner, name)

        def timed(*arguments: Any) -> Any:
            with self.running():
                return method(*arguments)

        setattr(owner, name, timed)
        try:
            yield
        finally:
            delattr(owner, name)
