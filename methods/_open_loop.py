"""What methods share that search plans, a design and an open-loop sequence of controls.

Shapes: `b` plans, `X` numbers of a plan, `I` instance, `O` observation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codesign_bench.method import Problem
from codesign_bench.task import Booleans, Floats, Singles, Task
from codesign_bench.task.episodes import portions
from codesign_bench.task.plans import controls_of, designs_of


def step_of(task: Task, observation: Singles) -> np.ndarray:
    """Return the number of control steps that observations (..., O) say have been taken, below the horizon."""
    elapsed = np.asarray(observation)[..., task.layout.phase.stop - 1]
    # The elapsed fraction is stored in single precision, so it is rounded to the nearest step, not down.
    return np.minimum(np.rint(elapsed * task.horizon).astype(int), task.horizon - 1)


@dataclass(frozen=True)
class Played:
    """What came of plans, each on its instance."""

    returns: Floats
    """(b,)"""
    steps: Floats
    """(b,) simulated environment steps, the design step included."""
    solved: Booleans
    """(b,)"""
    starts: Singles
    """(b, O) observations of the design step."""


def play(problem: Problem, plans: Floats, instances: Floats) -> Played:
    """Play plans (b, X) on one instance (b, I) each."""
    parts = [_play_part(problem, plans[part], instances[part]) for part in portions(len(plans), problem.task)]
    return Played(*(np.concatenate(values) for values in zip(*parts, strict=True)))


def _play_part(problem: Problem, plans: Floats, instances: Floats) -> tuple[Floats, Floats, Booleans, Singles]:
    task, slots = problem.task, np.arange(len(plans))
    controls = controls_of(task, plans)
    returns, steps, active = np.zeros(len(slots)), np.ones(len(slots)), slots
    with problem.episodes(len(slots)) as episodes:
        episodes.begin(slots, instances)
        starts = episodes.observation[slots].astype(np.float32)
        episodes.design(slots, designs_of(task, plans))
        for step in range(task.horizon):
            reward, terminated, truncated = episodes.control(active, controls[active, step])
            returns[active] += reward
            steps[active] += 1.0
            active = active[~(terminated | truncated)]
            if not active.size:
                break
        return returns, steps, episodes.success(slots).copy(), starts
