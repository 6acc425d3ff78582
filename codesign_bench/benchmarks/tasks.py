"""Speed of the tasks on this machine, compared with the bare physics engine: the overhead of the benchmark.

The engine's share is measured within the same run: the time in `Simulator.advance`, which only makes the engine's step
calls.

Shapes: `B` slots, `C` control.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from scipy.special import ndtr

from codesign_bench.benchmarks.output import write_speeds
from codesign_bench.console import print_table, printer
from codesign_bench.errors import UserError
from codesign_bench.learning.batches import GROUP_SLOTS, BatchCollector
from codesign_bench.learning.explorer import Explorer, Sample
from codesign_bench.method import Problem
from codesign_bench.seeding import Streams, generator
from codesign_bench.task import Singles, Slots, Task, load_task
from codesign_bench.task.episodes import Episodes

SLOTS = 64
HELD_STEPS = 10
"""Random controls are redrawn after this many steps."""
SEED = 0
GROUPS_PER_CORE = 4
"""Groups of slots of a batch for every core."""


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


@dataclass(frozen=True)
class Scaling:
    """Random episodes of one task in whole batches, on one core and on several."""

    cores: int
    one: float
    """Environment steps/s on one core."""
    several: float
    """The same on `cores` cores."""

    @property
    def row(self) -> tuple[str, ...]:
        """The cells of the printed table."""
        faster = self.several / self.one
        return f"{self.one:,.0f}", f"{self.several:,.0f}", f"{faster:.2f}", f"{faster / self.cores:.2f}"


class RandomActions(Explorer):
    """Uniform designs and controls, at next to no cost."""

    def __init__(self, task: Task) -> None:
        super().__init__(task.design_space.size, task.control_space.size)

    def sample_design(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Return the actions that standard-normal `noise` stands for."""
        return Sample((2.0 * ndtr(noise) - 1.0).astype(np.float32))

    sample_control = sample_design


HEADER = ("task", "env steps/s", "control step (us)", "engine (us)", "ratio", "episode starts")


SCALING_HEADER = ("task", "steps/s, 1 core", "steps/s, {cores} cores", "faster", "share of {cores}")


def bench_tasks(
    names: Sequence[str], seconds: float, console: Console, cores: int = 1, out: Path | None = None
) -> None:
    """Print the speed of tasks on one core and, if there are more `cores`, how batches of episodes scale with them.

    Args:
        names: names of tasks.
        seconds: time of each measurement.
        console: where tables go.
        cores: processes that share a batch.
        out: JSON file.

    Raises:
        UserError: an unknown task, or a file that is not writable.
    """
    tasks = {name: load_task(name) for name in names}
    speeds: dict[str, TaskSpeed] = {}
    for name in tasks:
        console.print(
            f"{name}: random episodes in {min(SLOTS, tasks[name].max_slots)} slots for {seconds:g} s",
            markup=False,
            highlight=False,
        )
        speeds[name] = measure_task(name, seconds)
    print_table(console, HEADER, [(name, *speed.row) for name, speed in speeds.items()])
    console.print(
        "control step: one slot's step with action, observation and reward\n"
        "engine: the physics engine's own step calls within it; ratio: the first over the second\n"
        "episode starts: their share of all time; one core, no learning",
        markup=False,
        highlight=False,
    )
    scaling = {name: measure_scaling(task, seconds, cores) for name, task in tasks.items()} if cores > 1 else {}
    if scaling:
        header = [text.format(cores=cores) for text in SCALING_HEADER]
        print_table(console, header, [(name, *found.row) for name, found in scaling.items()])
    content = {"tasks": _by_name(speeds), "scaling": _by_name(scaling)}
    write_speeds(out, content, cores, printer(console))


def _by_name(speeds: Mapping[str, TaskSpeed | Scaling]) -> dict[str, Any]:
    return {name: asdict(speed) for name, speed in speeds.items()}


def measure_scaling(task: Task, seconds: float, cores: int) -> Scaling:
    """Play whole batches of random episodes for about `seconds` each, on one core and on `cores`.

    A batch has one episode per slot, as in training, and several groups of slots for every core.
    """
    speeds = []
    for count in (1, cores):
        collector = BatchCollector(Problem(task), Streams(SEED))
        collector.use_cores(count)
        # The same slots on any number of cores: enough that no core waits for work for long.
        slots = GROUPS_PER_CORE * cores * min(GROUP_SLOTS, task.max_slots)
        steps = slots * (task.horizon + 1)
        collector.collect(RandomActions(task), slots, slots)  # starts processes and makes simulators
        begun, played = time.perf_counter(), 0
        while time.perf_counter() - begun < seconds:
            played += collector.collect(RandomActions(task), steps, slots).env_steps
        speeds.append(played / (time.perf_counter() - begun))
    return Scaling(cores, *speeds)


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
