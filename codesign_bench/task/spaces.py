"""Named, bounded spaces with units, the parts of an observation, and array types.

Shapes: `O` observation, `S` state, `G` goal, `D` design; `...` any leading axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Booleans = NDArray[np.bool_]
Slots = NDArray[np.intp]
Frame = NDArray[np.uint8]
"""A picture, (height, width, 3), in RGB."""
Span: TypeAlias = slice
"""Positions of adjacent entries of a space on the last axis of an array."""


@dataclass(frozen=True)
class Box:
    """A bounded space; every entry has a name, a unit and a range in that unit.

    Code refers to entries by name, so that only the definition of the space fixes their order:

        STATE = Box.of(puck_x=(-6.0, 30.0, "m"), puck_y=(-6.0, 30.0, "m"), distance=(0.0, 9.0, "m"))
        PUCK, DISTANCE = STATE.slice("puck_x", "puck_y"), STATE.index("distance")
        state[:, PUCK] = 0.0
    """

    names: tuple[str, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    units: tuple[str, ...]

    def __post_init__(self) -> None:
        if not len(self.names) == len(self.low) == len(self.high) == len(self.units):
            raise ValueError(f"names, low, high and units differ in length: {self}")
        if len(set(self.names)) < len(self.names):
            raise ValueError(f"two entries have the same name: {', '.join(self.names)}")

    @classmethod
    def of(cls, **entries: tuple[float, float, str]) -> Box:
        """Build a space from `name=(low, high, unit)` entries."""
        low, high, units = zip(*entries.values(), strict=True) if entries else ((), (), ())
        return cls(tuple(entries), low, high, units)

    @property
    def size(self) -> int:
        """Number of entries."""
        return len(self.names)

    def index(self, name: str) -> int:
        """Return the position of the entry `name`.

        Raises:
            ValueError: there is no such entry.
        """
        if name not in self.names:
            raise ValueError(f"no entry '{name}' among: {', '.join(self.names)}")
        return self.names.index(name)

    def slice(self, *names: str) -> Span:
        """Return the positions of the entries `names`, which must be adjacent and in this order.

        Raises:
            ValueError: an entry does not exist, or they are not adjacent.
        """
        positions = [self.index(name) for name in names]
        if not positions or positions != list(range(positions[0], positions[0] + len(positions))):
            raise ValueError(f"entries are not adjacent in this order: {', '.join(names) or 'no names'}")
        return slice(positions[0], positions[-1] + 1)

    def group(self, prefix: str) -> Span:
        """Return the positions of all entries whose names start with `prefix`; they must be adjacent.

        Raises:
            ValueError: no name starts with it, or the entries are not adjacent.
        """
        return self.slice(*(name for name in self.names if name.startswith(prefix)))

    def part(self, *names: str) -> Box:
        """Return the space of only the entries `names`, in this order.

        Raises:
            ValueError: an entry does not exist.
        """
        chosen = [self.index(name) for name in names]
        return Box(
            names,
            low=tuple(self.low[index] for index in chosen),
            high=tuple(self.high[index] for index in chosen),
            units=tuple(self.units[index] for index in chosen),
        )

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lower and upper bounds, each (size,), in the entries' units."""
        return np.array(self.low, dtype=np.float64), np.array(self.high, dtype=np.float64)

    def from_unit(self, values: ArrayLike) -> Floats:
        """Map (..., size) values in [-1, 1] to the entries' units."""
        low, high = self.bounds
        return low + (np.asarray(values, dtype=np.float64) + 1.0) * 0.5 * (high - low)

    def to_unit(self, values: ArrayLike) -> Floats:
        """Map (..., size) values in the entries' units to [-1, 1]."""
        low, high = self.bounds
        return 2.0 * (np.asarray(values, dtype=np.float64) - low) / (high - low) - 1.0

    def sample(self, rng: np.random.Generator, count: int) -> Floats:
        """Return (count, size) points drawn uniformly from the box, in the entries' units."""
        return rng.uniform(*self.bounds, size=(count, self.size))


class Observed(NamedTuple):
    """The parts of one observation (O,) or of many (..., O); each part keeps the leading axes."""

    state: NDArray[Any]
    """(..., S) in the state space's units."""
    goal: NDArray[Any]
    """(..., G) in the goal space's units; an instance starts with the goal, so its indices are the same."""
    design: NDArray[Any]
    """(..., D) in [-1, 1]."""
    phase: NDArray[Any]
    """(..., 3) design phase?, control phase?, elapsed fraction of the horizon."""


@dataclass(frozen=True)
class Layout:
    """Positions of the parts of an observation: [state | goal | design | phase]."""

    state: slice
    goal: slice
    design: slice
    phase: slice

    PHASE_NAMES: ClassVar[tuple[str, ...]] = ("design_phase", "control_phase", "elapsed_fraction")

    @classmethod
    def of(cls, state: int, goal: int, design: int) -> Layout:
        """Lay out an observation of the given part sizes."""
        ends = np.cumsum([state, goal, design, len(cls.PHASE_NAMES)])
        return cls(
            *(slice(int(end - size), int(end)) for end, size in zip(ends, (state, goal, design, 3), strict=True))
        )

    @property
    def size(self) -> int:
        """Length of an observation."""
        return self.phase.stop

    def split(self, observation: NDArray[Any]) -> Observed:
        """Return the parts of `observation` (..., O) as views: `split(seen).state[..., STATE.index("tilt")]`."""
        return Observed(*(observation[..., part] for part in (self.state, self.goal, self.design, self.phase)))


@dataclass(frozen=True)
class Quantity:
    """A measured quantity of a task, and its unit."""

    name: str
    unit: str
