"""Checks of a task's physics: it keeps what `soundness` promises, and looking and drawing change nothing.

Shapes: `b` episodes side by side, `D` design, `C` control.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from scipy import stats

from codesign_bench.contract.check import DoesWithoutError, Fault, promised
from codesign_bench.contract.task_script import script_of
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.task import Floats, Simulator, Soundness, Task, load_task
from codesign_bench.task.episodes import Episodes

SLOTS = 16
HELD_STEPS = 8
"""Random controls last so long, so that tools travel."""
SCRIPTED_EPISODES = 12
STEPS = 2 * SLOTS * 60
"""Control steps in all of the random episodes."""
SOUNDNESS = "codesign_bench.task.Soundness"


def limits_of(task: Task) -> Soundness:
    """Return what a task promises of its physics.

    Raises:
        DoesWithoutError: it promises nothing.
    """
    if task.soundness is None:
        raise DoesWithoutError("it promises nothing of its physics (`soundness`)")
    return task.soundness


def random_designs(rng: np.random.Generator, task: Task, count: int) -> Floats:
    """Return (count, D) designs: half of them corners of the design space, half inside."""
    inside = rng.uniform(-1.0, 1.0, size=(count, task.design_space.size))
    return np.where(np.arange(count)[:, None] % 2 == 0, np.sign(inside), inside)


def random_controls(rng: np.random.Generator, task: Task, count: int) -> Floats:
    """Return (count, C) controls: half of them at their bounds, half inside."""
    inside = rng.uniform(-1.0, 1.0, size=(count, task.control_space.size))
    return np.where(rng.random(count)[:, None] < 0.5, np.sign(inside), inside)


@dataclass
class Worst:
    """The worst that was seen."""

    start_overlap: float = 0.0
    overlap: float = 0.0
    speed: float = 0.0
    contained: bool = True
    finite: bool = True

    def look(self, simulator: Simulator, slots: np.ndarray) -> None:
        """Take in the scenes of some slots."""
        for slot in slots.tolist():
            seen = simulator.inspect(slot)
            self.overlap = max(self.overlap, seen.overlap)
            self.speed = max(self.speed, seen.speed)
            self.contained &= seen.contained


def play_at_random(task: Task, steps: int) -> Worst:
    """Play random episodes for so many control steps in all; look at every scene after every step."""
    rng, slots, worst = np.random.default_rng(11), np.arange(SLOTS), Worst()
    episodes = Episodes(task, SLOTS)
    starting, controls = slots, np.zeros((SLOTS, task.control_space.size))
    for step in range(steps // SLOTS):
        if starting.size:
            episodes.begin(starting, task.sample_instances(rng, starting.size))
            episodes.design(starting, random_designs(rng, task, starting.size))
            overlaps = [episodes.simulator.inspect(slot).overlap for slot in starting.tolist()]
            worst.start_overlap = max(worst.start_overlap, *overlaps)
        if step % HELD_STEPS == 0:
            controls = random_controls(rng, task, SLOTS)
        reward, terminated, truncated = episodes.control(slots, controls)
        worst.finite &= all(np.isfinite(values).all() for values in (reward, episodes.simulator.outcome))
        worst.finite &= bool(np.isfinite(episodes.observation).all())
        worst.look(episodes.simulator, slots)
        starting = slots[terminated | truncated]
    return worst


def broken_limits(task: Task, steps: int) -> Iterator[Fault]:
    """Yield the limits that random episodes of so many control steps in all break."""
    limits, worst = limits_of(task), play_at_random(task, steps)
    if worst.start_overlap > limits.start_overlap:
        yield Fault(
            f"a tool overlaps something by {worst.start_overlap:.3g} m right after the design step",
            f"{limits.start_overlap:g} m at most",
        )
    if worst.overlap > limits.overlap:
        yield Fault(f"two bodies overlap by {worst.overlap:.3g} m", f"{limits.overlap:g} m at most")
    if not 0.0 < worst.speed <= limits.speed:
        yield Fault(f"the fastest body moves at {worst.speed:.3g} m/s", f"above 0 and at most {limits.speed:g} m/s")
    if not worst.contained:
        yield Fault("a body is on the wrong side of a wall or a floor", "none")
    if not worst.finite:
        yield Fault("a reward, an outcome or an observation is not finite", "finite values")


@promised("Nothing overlaps, runs away or escapes, whatever the tool and the controls.", SOUNDNESS)
def limits_are_kept(task: Task) -> Iterator[Fault]:
    """Yield limits that a few thousand random steps break."""
    yield from broken_limits(task, STEPS)


@promised("Half the physics step leaves the outcome of the script alike.", f"{SOUNDNESS}.outcome_change")
def physics_steps_are_short(task: Task) -> Iterator[Fault]:
    """Yield outcomes that change."""
    yield from changed_outcomes(task, SCRIPTED_EPISODES)


def changed_outcomes(task: Task, count: int) -> Iterator[Fault]:
    """Yield how half the physics step changes the outcomes of the script on the first `count` instances."""
    limits = limits_of(task)
    script_of(task)
    coarse, fine = (_outcomes(_refined(task, refinement), count) for refinement in (1, 2))
    if not limits.chaotic:
        change = float(np.median(np.abs(coarse - fine)))
        if change >= limits.outcome_change:
            yield Fault(f"the median episode's outcome changes by {change:.3g}", f"less than {limits.outcome_change:g}")
        return
    # Single episodes differ; what is promised is their distribution.
    change = abs(float(coarse.mean() - fine.mean()))
    if change >= limits.outcome_change:
        yield Fault(f"the mean outcome changes by {change:.3g}", f"less than {limits.outcome_change:g}")
    if (chance := stats.ks_2samp(coarse, fine).pvalue) <= 0.01:
        yield Fault(f"outcomes have another distribution (p = {chance:.2g})", "the same distribution")


def _refined(task: Task, refinement: int) -> Task:
    """Return the task with finer physics steps."""
    other = load_task(task.name)
    make = other.make_simulator
    # An evaluation asks for simulators without a refinement.
    other.make_simulator = lambda num_slots: make(num_slots, refinement)  # type: ignore[method-assign,misc,assignment]
    return other


def _outcomes(task: Task, count: int) -> Floats:
    return evaluate(task, task.script(), instances=task.evaluation_instances()[:count]).outcomes


@promised(
    "Looking and drawing change nothing, and a picture shows what happens.", "codesign_bench.task.Simulator.render"
)
def looking_changes_nothing(task: Task) -> Iterator[Fault]:
    """Yield what they change, and pictures that are none."""
    rng = np.random.default_rng(2)
    instance, design = task.sample_instances(rng, 1), random_designs(rng, task, 1)
    controls = np.repeat(random_controls(rng, task, 4), 3, axis=0)
    watched, alone = (Episodes(task, 1) for _ in range(2))
    if not watched.simulator.draws:
        raise DoesWithoutError("it draws no pictures")
    slot, pictures = np.array([0]), []
    for episodes in (watched, alone):
        episodes.begin(slot, instance)
        episodes.design(slot, design)
        for step, control in enumerate(controls):
            _, terminated, truncated = episodes.control(slot, control[None])
            if episodes is watched:
                with suppress(NotImplementedError):  # `inspect` is optional
                    watched.simulator.inspect(0)
                if step % 6 == 0:
                    pictures.append(watched.simulator.render(0))
            if (terminated | truncated).any():
                break
    if not np.array_equal(watched.observation, alone.observation):
        yield Fault("an episode that is looked at goes another way", "`inspect` and `render` change nothing")
    first, last = pictures[0], pictures[-1]
    if first.dtype != np.uint8 or first.ndim != 3 or first.shape[2] != 3:
        yield Fault(f"a picture of shape {first.shape} and type {first.dtype}", "(height, width, 3) and uint8")
        return
    if len(np.unique(first.reshape(-1, 3), axis=0)) <= 2:
        yield Fault("a picture of two colours or one", "more than a background and one thing")
    if len(pictures) > 1 and (first == last).all():
        yield Fault(f"pictures {6 * (len(pictures) - 1)} control steps apart are the same", "that something has moved")
