"""Transitions of two-phase episodes, and a replay buffer of them for off-policy learners.

Shapes: `n` transitions, `O` observation, `D` design, `C` control.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

from codesign_bench.learning.trajectories import Trajectories
from codesign_bench.method import Array
from codesign_bench.task import Booleans, Singles, Slots, Task


@dataclass(frozen=True)
class Transitions:
    """Single steps in any order; a design step is a transition whose action is a design."""

    observation: Singles
    """(n, O)"""
    is_design: Booleans
    """(n,)"""
    design: Singles
    """(n, D) zero at control steps."""
    control: Singles
    """(n, C) zero at design steps."""
    reward: Singles
    """(n,)"""
    next_observation: Singles
    """(n, O) arbitrary where `terminated`."""
    terminated: Booleans
    """(n,) whether success or failure ended the episode; False at the time limit."""

    @classmethod
    def of(cls, batch: Trajectories) -> Transitions:
        """Return the valid steps of `batch`."""
        arrays = {field.name: getattr(batch, field.name)[batch.valid] for field in fields(cls)}
        return cls(**{**arrays, "reward": arrays["reward"].astype(np.float32)})

    @classmethod
    def empty(cls, count: int, task: Task) -> Transitions:
        """Return zero-filled storage for `count` transitions of `task`."""

        def singles(*size: int) -> Singles:
            return np.zeros((count, *size), dtype=np.float32)

        observation, design, control = task.layout.size, task.design_space.size, task.control_space.size
        return cls(
            observation=singles(observation),
            is_design=np.zeros(count, dtype=bool),
            design=singles(design),
            control=singles(control),
            reward=singles(),
            next_observation=singles(observation),
            terminated=np.zeros(count, dtype=bool),
        )

    def rows(self, index: Slots | slice) -> Transitions:
        """Return some of the transitions."""
        return Transitions(**{name: array[index] for name, array in vars(self).items()})

    def followed_by(self, other: Transitions) -> Transitions:
        """Return these transitions and then those of `other`."""
        return Transitions(
            **{name: np.concatenate([array, getattr(other, name)]) for name, array in vars(self).items()}
        )

    def __len__(self) -> int:
        return len(self.reward)


class ReplayBuffer:
    """The most recent transitions; new ones overwrite the oldest."""

    def __init__(self, capacity: int, task: Task) -> None:
        self.added = 0
        """Number of transitions ever added."""
        self._store = Transitions.empty(capacity, task)

    def __len__(self) -> int:
        return min(self.added, len(self._store))

    def add(self, new: Transitions) -> None:
        """Add transitions in order."""
        rows = (self.added + np.arange(len(new))) % len(self._store)
        latest = slice(max(0, len(new) - len(self._store)), None)  # earlier ones would be overwritten at once
        for name, array in vars(self._store).items():
            array[rows[latest]] = getattr(new, name)[latest]
        self.added += len(new)

    def sample(self, count: int, rng: np.random.Generator, latest: int | None = None) -> Transitions:
        """Return `count` transitions, drawn uniformly with replacement, from as many of the `latest`; None: all."""
        among = len(self) if latest is None else min(latest, len(self))
        # Where not all are wanted, the oldest of them comes first.
        first = 0 if among == len(self) else self.added - among
        return self._store.rows((first + rng.integers(among, size=count)) % len(self._store))

    @property
    def held(self) -> Transitions:
        """All transitions in the buffer, in no particular order; not copies."""
        return self._store.rows(slice(len(self)))

    def arrays(self) -> dict[str, Array]:
        """Return the arrays for `load`, without copies, as `State.large` allows."""
        return {**vars(self.held), "added": np.array(self.added)}

    def load(self, arrays: Mapping[str, Array]) -> None:
        """Restore the arrays that `arrays` returned."""
        self.added = int(arrays["added"])
        for name, array in vars(self._store).items():
            array[: len(self)] = arrays[name]
