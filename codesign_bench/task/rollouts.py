"""The episodes behind Gymnasium environments, single and batched.

Shapes: `B` environments, `b` those of a call, `D` design, `C` control, `I` instance.
"""

from __future__ import annotations

from collections.abc import Sequence

import gymnasium
import numpy as np

from codesign_bench.task.checks import NotCopied
from codesign_bench.task.episodes import Episodes, Tradeoff
from codesign_bench.task.spaces import Booleans, Floats, Frame, Slots
from codesign_bench.task.task import Task


class Rollouts(NotCopied):
    """The episodes of `B` environments, which may be in different phases."""

    def __init__(self, task: Task, num_slots: int, tradeoff: Tradeoff | None) -> None:
        self.task = task
        self._episodes: Episodes | None = Episodes(task, num_slots, tradeoff)
        self.designing: Booleans = np.zeros(num_slots, dtype=bool)
        """(B,) whether the next step is the design step."""
        self.ended: Booleans = np.ones(num_slots, dtype=bool)
        """(B,) whether the episode has ended or was never started."""
        self.started: Booleans = np.zeros(num_slots, dtype=bool)
        """(B,) whether an episode was ever started."""
        self.controlled: Booleans = np.zeros(num_slots, dtype=bool)
        """(B,) whether the last step was a control step."""

    @property
    def episodes(self) -> Episodes:
        """The episodes themselves.

        Raises:
            gymnasium.error.ClosedEnvironmentError: they were given up by `close`.
        """
        if self._episodes is None:
            raise gymnasium.error.ClosedEnvironmentError("the environment was closed; make another one")
        return self._episodes

    def close(self) -> None:
        """Give up the simulator."""
        self._episodes = None

    def reset(self, slots: Slots, instances: Floats) -> None:
        """Begin episodes of `instances` (b, I) in `slots` (b,)."""
        self.episodes.begin(slots, instances)
        self.designing[slots] = self.started[slots] = True
        self.ended[slots] = self.controlled[slots] = False

    def step(self, slots: Slots, actions: Floats) -> tuple[Floats, Booleans, Booleans]:
        """Take one design or control step in `slots` (b,) with actions (b, D + C).

        `actions` have been checked, so that either all episodes take the step or none.

        Returns:
            reward, terminated and truncated, each (b,).
        """
        reward = np.zeros(len(slots))
        terminated, truncated = np.zeros(len(slots), dtype=bool), np.zeros(len(slots), dtype=bool)
        size = self.task.design_space.size
        first = self.designing[slots]
        if first.any():
            self.episodes.design(slots[first], actions[first, :size])
        if not first.all():
            later = ~first
            outcome = self.episodes.control(slots[later], actions[later, size:])
            reward[later], terminated[later], truncated[later] = outcome
        self.designing[slots] = False
        self.controlled[slots] = ~first
        self.ended[slots] = terminated | truncated
        return reward, terminated, truncated

    def render(self, slot: int) -> Frame:
        """Return a picture of the scene in `slot`, (height, width, 3), in RGB.

        Raises:
            gymnasium.error.ResetNeeded: no episode was started.
        """
        self.need_start("render")
        return self.episodes.simulator.render(slot)

    def need_start(self, call: str) -> None:
        """Raise `gymnasium.error.ResetNeeded` if `call` comes before the first episode of an environment."""
        if not self.started.all():
            raise gymnasium.error.ResetNeeded(f"no episode was started: call reset() before {call}()")

    def sample(self, slot_generators: Sequence[np.random.Generator]) -> Floats:
        """Return (b, I) instances, one per generator: an environment's instances do not depend on the others."""
        return np.concatenate([self.task.sample_instances(rng, 1) for rng in slot_generators])
