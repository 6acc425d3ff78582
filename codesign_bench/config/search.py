"""Ranges in which settings are searched, declared where the setting is: `metadata={"search": LogUniform(1e-4, 1e-2)}`.

A range maps a share in [0, 1) to a value: half of all draws are below the value at 0.5. Each setting draws its shares
from the stream of its own name, so the i-th draw of a setting is the same for all methods that have this setting.

A library for hyperparameter search would bring its own random numbers, files and processes. Here, every draw must come
from a named stream and be stored with the cell that uses it, which takes fewer lines than an adapter.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, TypeAlias

from codesign_bench.seeding import generator

SEARCH = "search"
"""Key of a field's metadata whose value is the field's range."""
NOT_SEARCHED = "not_searched"
"""Class variable of a configuration: names of inherited fields that have a range but no effect in this method."""
DIGITS = 4
"""Significant digits of drawn numbers: enough for any setting, and short enough to type."""

BELOW_ONE = math.nextafter(1.0, 0.0)

Condition: TypeAlias = tuple[str, Any]
"""Name of another setting and the value that it must have."""


@dataclass(frozen=True)
class Range(ABC):
    """Values that a setting may take, with their distribution."""

    where: Condition | None = field(default=None, kw_only=True)
    """The setting has an effect, and is searched, only under this condition; None: always."""

    @abstractmethod
    def at(self, share: float) -> Any:
        """Return the value below which the share, in [0, 1), of all draws lies."""

    @abstractmethod
    def place(self, value: Any) -> float:
        """Return the share at which a value of this range lies; of an integer or a choice, the middle of its shares."""

    def near(self, value: Any, share: float, spread: float) -> Any:
        """Return the value at `share` of a window around `value` that holds the share `spread` of all draws.

        The window stays within the range. None stands for a default that depends on the task: the window is the range.

        Raises:
            ValueError: the value is not one of the choices.
        """
        if value is None:
            return self.at(share)
        first = min(max(self.place(value) - spread / 2, 0.0), 1.0 - spread)
        return self.at(min(first + share * spread, BELOW_ONE))


@dataclass(frozen=True)
class Uniform(Range):
    """Numbers from `low` to `high`, all equally likely."""

    low: float
    high: float

    def at(self, share: float) -> float:
        """Return a number, rounded to four digits."""
        return _rounded(self.low + share * (self.high - self.low))

    def place(self, value: float) -> float:
        """Return the share of the way from `low` to `high`."""
        return (value - self.low) / (self.high - self.low)

    def __str__(self) -> str:
        return f"{self.low:g} to {self.high:g}"


@dataclass(frozen=True)
class LogUniform(Range):
    """Positive numbers from `low` to `high` whose logarithms are equally likely."""

    low: float
    high: float

    def at(self, share: float) -> float:
        """Return a number, rounded to four digits."""
        return _rounded(self.low * (self.high / self.low) ** share)

    def place(self, value: float) -> float:
        """Return the share of the way from `low` to `high` on a logarithmic scale."""
        return math.log(value / self.low) / math.log(self.high / self.low)

    def __str__(self) -> str:
        return f"{self.low:g} to {self.high:g}, log"


@dataclass(frozen=True)
class Integer(Range):
    """Integers from `low` to `high`, both included; with `log`, their logarithms are about equally likely."""

    low: int
    high: int
    log: bool = False

    def at(self, share: float) -> int:
        """Return an integer."""
        count = self.high + 1 - self.low
        value = self.low * ((self.high + 1) / self.low) ** share if self.log else self.low + share * count
        return min(math.floor(value), self.high)  # rounding could reach high + 1

    def place(self, value: int) -> float:
        """Return the share in the middle of those that give the integer."""
        if self.log:
            return math.log((value + 0.5) / self.low) / math.log((self.high + 1) / self.low)
        return (value + 0.5 - self.low) / (self.high + 1 - self.low)

    def __str__(self) -> str:
        return f"integers {self.low} to {self.high}{', log' if self.log else ''}"


@dataclass(frozen=True)
class Choice(Range):
    """One of a few values, all equally likely."""

    values: tuple[Any, ...]

    def at(self, share: float) -> Any:
        """Return one of the values."""
        return self.values[int(share * len(self.values))]

    def place(self, value: Any) -> float:
        """Return the share in the middle of those that give the value.

        Raises:
            ValueError: the value is not among the choices.
        """
        return (self.values.index(value) + 0.5) / len(self.values)

    def __str__(self) -> str:
        return f"one of {', '.join(map(str, self.values))}"


def ranges(config: Any) -> dict[str, Range]:
    """Return the settings of a configuration that are searched, with their ranges; conditions are those of its values.

    Args:
        config: an instance of a method's `config_class`.
    """
    declared = {entry.name: entry.metadata[SEARCH] for entry in fields(config) if SEARCH in entry.metadata}
    left_out = getattr(config, NOT_SEARCHED, ())
    return {name: found for name, found in declared.items() if name not in left_out and _holds(found.where, config)}


def draw(
    searched: Mapping[str, Range], count: int, seed: int, around: Mapping[str, Any] | None = None, spread: float = 1.0
) -> list[dict[str, Any]]:
    """Return `count` random settings: name -> value for every range. The first ones are the same for any count.

    Args:
        searched: name -> range.
        count: number of settings.
        seed: of the draws; every name has a stream of its own.
        around: name -> value around which to draw; None: draw from the whole range.
        spread: share of a range that is drawn from around a value (`Range.near`).
    """
    shares = {name: generator(seed, f"search of {name}").random(count) for name in searched}

    def value(name: str, share: float) -> Any:
        return searched[name].at(share) if around is None else searched[name].near(around[name], share, spread)

    return [{name: value(name, float(shares[name][index])) for name in searched} for index in range(count)]


def _holds(condition: Condition | None, config: Any) -> bool:
    return condition is None or getattr(config, condition[0]) == condition[1]


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
