"""Named, bounded spaces with units, the parts of an observation, and the names of array types.

Shapes: `S` state, `G` goal, `D` design.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Booleans = NDArray[np.bool_]
Slots = NDArray[np.intp]
Frame = NDArray[np.uint8]
"""A picture, (height, width, 3), in RGB."""


@dataclass(frozen=True)
class Box:
    """A bounded space whose every entry has a name, a unit and a range in that unit."""

    names: tuple[str, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    units: tuple[str, ...]

    def __post_init__(self) -> None:
        if not len(self.names) == len(self.low) == len(self.high) == len(self.units):
            raise ValueError(f"names, low, high and units differ in length: {self}")

    @classmethod
    def of(cls, **entries: tuple[float, float, str]) -> Box:
        """Build a space from `name=(low, high, unit)` entries."""
        low, high, units = zip(*entries.values(), strict=True) if entries else ((), (), ())
        return cls(tuple(entries), low, high, units)

    @property
    def size(self) -> int:
        """Number of entries."""
        return len(self.names)

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
        """Return (count, size) points, uniform in the box, in the entries' units."""
        return rng.uniform(*self.bounds, size=(count, self.size))


@dataclass(frozen=True)
class Layout:
    """Where each part of an observation lies: [state | goal | design | phase].

    The phase part is (design phase?, control phase?, elapsed fraction of the horizon).
    """

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


@dataclass(frozen=True)
class Quantity:
    """What a number of a task measures, and its unit."""

    name: str
    unit: str
