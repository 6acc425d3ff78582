"""Random episodes that are played from a script and recorded, so that two ways of playing them can be compared.

Shapes: `b` episodes played side by side, `T` control steps, `O` observation, `D` design, `C` control, `I` instance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codesign_bench.task import Booleans, Floats, Singles, Slots, Task
from codesign_bench.task.episodes import Episodes

EPISODES = 4
STEPS = 60
"""Control steps of the rollouts that are compared; enough for tools to meet what they move."""
HELD_STEPS = 10
"""Random controls last so long, so that tools travel."""


@dataclass(frozen=True)
class Script:
    """What is sent to a few episodes: instances (b, I), designs (b, D), controls (T, b, C)."""

    instances: Floats
    designs: Floats
    controls: Floats

    def one(self, index: int) -> Script:
        """Return one episode of the script."""
        keep = slice(index, index + 1)
        return Script(self.instances[keep], self.designs[keep], self.controls[:, keep])


@dataclass
class Recording:
    """What came back: observations (T + 2, b, O), rewards (T, b), both ends (T, b), each up to an episode's end."""

    observation: Singles
    reward: Floats
    terminated: Booleans
    truncated: Booleans

    def one(self, index: int) -> Recording:
        """Return one episode of the recording."""
        return Recording(**{name: values[:, index : index + 1] for name, values in vars(self).items()})


def random_script(task: Task, count: int = EPISODES, steps: int | None = None) -> Script:
    """Return a random script of `count` episodes whose controls persist for a while."""
    rng = np.random.default_rng(5)
    steps = min(task.horizon, STEPS) if steps is None else steps
    held = rng.uniform(-1.0, 1.0, size=(steps // HELD_STEPS + 1, count, task.control_space.size))
    return Script(
        task.sample_instances(rng, count),
        rng.uniform(-1.0, 1.0, size=(count, task.design_space.size)),
        np.repeat(held, HELD_STEPS, axis=0)[:steps],
    )


def record(episodes: Episodes, script: Script, slots: Slots) -> Recording:
    """Play the script's episodes, the first in the first of `slots` (b,); what follows an end stays zero."""
    steps, count = script.controls.shape[:2]
    seen = np.zeros((steps + 2, count, episodes.layout.size), dtype=np.float32)
    recording = Recording(seen, np.zeros((steps, count)), *np.zeros((2, steps, count), dtype=bool))
    episodes.begin(slots, script.instances)
    seen[0] = episodes.observation[slots]
    episodes.design(slots, script.designs)
    seen[1] = episodes.observation[slots]
    active = np.arange(count)
    for step in range(steps):
        results = episodes.control(slots[active], script.controls[step, active])
        seen[step + 2, active] = episodes.observation[slots[active]]
        recording.reward[step, active], recording.terminated[step, active], recording.truncated[step, active] = results
        active = active[~(results[1] | results[2])]
        if not active.size:
            break
    return recording


def difference(task: Task, first: Recording, second: Recording) -> str:
    """Return the first value in which two recordings differ, in words; empty: they are the same to the last bit."""
    names = (*task.state_space.names, *task.goal_space.names, *task.design_space.names, *task.layout.PHASE_NAMES)
    for field, values in vars(first).items():
        unlike = np.argwhere(values != vars(second)[field])
        if len(unlike):
            where = tuple(unlike[0].tolist())
            what = f"observation of {names[where[2]]}" if field == "observation" else field
            when = _moment(where[0] if field == "observation" else where[0] + 2)
            return f"the {what} {when}: {values[where]:.9g} and {vars(second)[field][where]:.9g}"
    return ""


def _moment(index: int) -> str:
    """Return when the observation of an index is made."""
    return ("at the start", "after the design step")[index] if index < 2 else f"after control step {index - 1}"
