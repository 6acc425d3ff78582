"""The random settings of a method on a task, and their cells in a rung."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from codesign_bench.cell.cell import Cell
from codesign_bench.cell.variant import Variant
from codesign_bench.config.resolve import resolve
from codesign_bench.config.search import draw, ranges
from codesign_bench.errors import UserError
from codesign_bench.method import load_method
from codesign_bench.study.tuning import Tuning


@dataclass(frozen=True)
class Setting:
    """Values of all searched hyperparameters of a method on a task."""

    task: str
    method: str
    number: int
    """Its place among the settings of the search, from 0."""
    values: Mapping[str, Any]
    """Hyperparameter -> value; empty: the profile's settings."""

    @property
    def overrides(self) -> tuple[str, ...]:
        """Its values in the form of `--set`."""
        return tuple(f"{self.method}.{name}={value}" for name, value in self.values.items())

    def cells(self, tuning: Tuning, rung: int, profile: str, steps: int) -> list[Cell]:
        """Return its cells in a rung, one for each seed, with a budget of `steps`."""
        variant = Variant.of(rung=rung, setting=self.number)
        return [Cell(self.task, self.method, seed, variant, profile, steps, self.overrides) for seed in tuning.seeds]


def settings_of(tuning: Tuning, task: str, method: str, profile: str) -> list[Setting]:
    """Return the settings with which the search of a method on a task starts.

    The profile's values are among them only in a search around them (`Tuning.spread`): they are the result of earlier
    tuning, of which some methods got more.

    Raises:
        UserError: the method declares no range.
    """
    config = resolve(load_method(method), task, profile).method
    searched = ranges(config)
    if not searched:
        raise UserError(f"'{method}' declares no range to search; see docs/tuning.md")
    if tuning.spread is None:
        drawn = draw(searched, tuning.settings, tuning.draw)
    else:
        around = {name: getattr(config, name) for name in searched}
        drawn = [{}, *draw(searched, tuning.settings - 1, tuning.draw, around, tuning.spread)]
    return [Setting(task, method, number, values) for number, values in enumerate(drawn)]


def budgets_of(tuning: Tuning, task: str, profile: str, steps: int | None) -> list[int]:
    """Return the budget of a cell in each rung on a task, for the profile's budget or the budget `steps`.

    Raises:
        UserError: an unknown name.
    """
    (full,) = {resolve(load_method(method), task, profile, (), steps).run.steps for method in tuning.methods}
    return tuning.budgets(full)


def cells_in_turn(cells: Iterable[list[Cell]]) -> list[Cell]:
    """Return the cells of several settings, ordered so that an unfinished rung has about as many of each method."""
    everything = [cell for of_setting in cells for cell in of_setting]
    return sorted(everything, key=lambda cell: (cell.task, cell.seed, cell.variant.values))
