"""Every task's physics holds what its `soundness` promises: nothing overlaps, runs away, escapes or leaks.

The same checks run over every task; each is held to its own limits. `make test` plays a few thousand steps, `make slow`
a million.

Shapes: `b` episodes side by side, `D` design, `C` control.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from builders import offered
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.task import Floats, Simulator, Soundness, Task, load_task, task_names
from codesign_bench.task.episodes import Episodes

pytestmark = pytest.mark.numeric

SLOTS = 16
HELD_STEPS = 8
"""Random controls last so long, so that tools travel."""
SCRIPTED_EPISODES = 12


@pytest.fixture(params=task_names())
def task(request: pytest.FixtureRequest) -> Task:
    """Every task, one after the other."""
    return load_task(request.param)


def limits_of(task: Task) -> Soundness:
    """Return what a task promises; skip where it promises nothing."""
    if task.soundness is None:
        pytest.skip("promises nothing of its physics")
    return task.soundness


def designs_for(rng: np.random.Generator, task: Task, count: int) -> Floats:
    """Return (count, D) designs: half of them corners of the design space, half inside."""
    inside = rng.uniform(-1.0, 1.0, size=(count, task.design_space.size))
    return np.where(np.arange(count)[:, None] % 2 == 0, np.sign(inside), inside)


def controls_for(rng: np.random.Generator, task: Task, count: int) -> Floats:
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
            episodes.design(starting, designs_for(rng, task, starting.size))
            overlaps = [episodes.simulator.inspect(slot).overlap for slot in starting.tolist()]
            worst.start_overlap = max(worst.start_overlap, *overlaps)
        if step % HELD_STEPS == 0:
            controls = controls_for(rng, task, SLOTS)
        reward, terminated, truncated = episodes.control(slots, controls)
        assert np.isfinite(reward).all()
        assert np.isfinite(episodes.observation).all()
        assert np.isfinite(episodes.simulator.outcome).all()
        worst.look(episodes.simulator, slots)
        starting = slots[terminated | truncated]
    return worst


@pytest.mark.parametrize(
    "steps", [2 * SLOTS * 60, pytest.param(1_000_000, marks=pytest.mark.slow)], ids=["a few", "a million"]
)
def test_nothing_overlaps_runs_away_or_escapes_whatever_the_tool_and_the_controls(task: Task, steps: int) -> None:
    limits, worst = limits_of(task), play_at_random(task, steps)
    assert worst.start_overlap <= limits.start_overlap
    assert worst.overlap <= limits.overlap
    assert 0.0 < worst.speed <= limits.speed
    assert worst.contained


@pytest.mark.parametrize("count", [SCRIPTED_EPISODES, pytest.param(96, marks=pytest.mark.slow)], ids=["a few", "many"])
def test_half_the_physics_step_leaves_the_outcome_of_a_script_alike(task: Task, count: int) -> None:
    limits = limits_of(task)
    coarse, fine = (outcomes(_Refined(task, refinement), count) for refinement in (1, 2))
    if limits.chaotic:  # Single episodes differ; what is promised is their distribution.
        assert abs(coarse.mean() - fine.mean()) < limits.outcome_change
        assert stats.ks_2samp(coarse, fine).pvalue > 0.01
    else:
        assert np.median(np.abs(coarse - fine)) < limits.outcome_change


class _Refined(Task):
    """A task whose physics steps are finer."""

    def __new__(cls, task: Task, refinement: int) -> Task:  # type: ignore[misc]  # it looks like the task itself
        other = load_task(task.name)
        make = other.make_simulator
        other.make_simulator = lambda num_slots: make(num_slots, refinement)  # type: ignore[method-assign,misc,assignment]
        return other


def outcomes(task: Task, count: int) -> Floats:
    """Return the outcomes of the task's script on its first instances."""
    return evaluate(task, task.script(), instances=task.evaluation_instances()[:count]).outcomes


def test_looking_and_drawing_change_nothing(task: Task) -> None:
    rng = np.random.default_rng(2)
    instance, design = task.sample_instances(rng, 1), designs_for(rng, task, 1)
    controls = np.repeat(controls_for(rng, task, 4), 3, axis=0)
    watched, alone = (Episodes(task, 1) for _ in range(2))
    slot = np.array([0])
    pictures = []
    for episodes in (watched, alone):
        episodes.begin(slot, instance)
        episodes.design(slot, design)
        for step, control in enumerate(controls):
            episodes.control(slot, control[None])
            if episodes is watched:
                offered(lambda: watched.simulator.inspect(0))
                if step % 6 == 0:
                    pictures.append(offered(lambda: watched.simulator.render(0)))
    np.testing.assert_array_equal(watched.observation, alone.observation)
    first, last = pictures[0], pictures[-1]
    assert first.dtype == np.uint8
    assert first.ndim == 3
    assert first.shape[2] == 3
    assert len(np.unique(first.reshape(-1, 3), axis=0)) > 2, "more than a background and one thing"
    assert (first != last).any(), "a picture shows that something moved"


@pytest.mark.slow
def test_memory_stays_flat_over_twenty_thousand_tools(task: Task) -> None:
    rng, slots = np.random.default_rng(3), np.arange(SLOTS)
    episodes = Episodes(task, SLOTS)

    def rebuild(count: int) -> None:
        for _ in range(count // SLOTS):
            episodes.begin(slots, task.sample_instances(rng, SLOTS))
            episodes.design(slots, designs_for(rng, task, SLOTS))
            episodes.control(slots, controls_for(rng, task, SLOTS))

    rebuild(2_000)
    before = resident_megabytes()
    rebuild(20_000)
    assert resident_megabytes() - before < 10.0


def resident_megabytes() -> float:
    """Return the memory that this process holds."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20
