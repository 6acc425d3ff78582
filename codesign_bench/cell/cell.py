"""A cell: one method on one task in one variant with one seed, as plain values that can be sent as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from codesign_bench.cell.axes import axis_named
from codesign_bench.cell.variant import DEFAULT, Variant
from codesign_bench.config.profiles import DEFAULT_PROFILE
from codesign_bench.config.resolve import ResolvedConfig, check_overrides, differences, resolve
from codesign_bench.config.run_settings import VALIDATION
from codesign_bench.config.settings import StoredConfig
from codesign_bench.console import Log
from codesign_bench.method import Method, Problem, load_method, usable_methods
from codesign_bench.task import Task, load_task, usable_tasks


@dataclass(frozen=True)
class Cell:
    """One method on one task; task, method, variant and seed determine the folder of its results."""

    task: str
    method: str
    seed: int
    variant: Variant = DEFAULT
    profile: str = DEFAULT_PROFILE
    steps: int | None = None
    """Budget in environment steps, or None for the profile's."""
    overrides: tuple[str, ...] = ()
    """`key=value` entries of `--set`."""

    @property
    def name(self) -> str:
        """Its path below the results folder, e.g. `push/gnn_ppo/default/seed-00`."""
        return f"{self.task}/{self.method}/{self.variant.name}/seed-{self.seed:02d}"

    def folder(self, out: Path) -> Path:
        """Return the folder of its results below `out`."""
        return out / self.name

    @property
    def pretrained(self) -> Cell | None:
        """The cell whose final policy it starts from, or None."""
        for axis, _ in self.variant:
            before = axis_named(axis).pretrained(self.variant)
            if before is not None:
                return replace(self, variant=before)
        return None

    def to_json(self) -> str:
        """Return the cell as a line of JSON."""
        return json.dumps({**asdict(self), "variant": self.variant.to_json()})

    @classmethod
    def from_json(cls, text: str) -> Cell:
        """Return the cell that `to_json` wrote."""
        values = json.loads(text)
        variant, overrides = Variant.from_json(values["variant"]), tuple(values["overrides"])
        return cls(**{**values, "variant": variant, "overrides": overrides})


@dataclass(frozen=True)
class ResolvedCell:
    """A cell with its task, method and configuration; made by `resolve_cell`, once per process."""

    cell: Cell
    task: Task
    method_class: type[Method[Any]]
    config: ResolvedConfig

    def differences(self, stored: StoredConfig, task_version: int) -> list[str]:
        """Return "name: stored X, requested Y" for each value in which a stored cell differs from this one."""
        found = differences(stored, self.config)
        if task_version != self.task.version:
            found.insert(0, f"version of task '{self.task.name}': stored {task_version}, requested {self.task.version}")
        return found

    def problem(self) -> Problem:
        """Return the learning problem of its method."""
        problem = Problem(self.task, validation=self.config.run.instances == VALIDATION)
        for axis, value in self.cell.variant:
            problem = axis_named(axis).problem(problem, value, self.config.run)
        return problem


def resolve_cell(cell: Cell, *, plays: bool = True) -> ResolvedCell:
    """Return the cell with its task, method and configuration; with `plays=False` it can be described, but not run.

    Raises:
        UserError: an unknown name, or an invalid value.
    """
    method_class = load_method(cell.method)
    varied = [text for axis, value in cell.variant for text in axis_named(axis).overrides(value)]
    config = resolve(method_class, cell.task, cell.profile, cell.overrides, cell.steps, varied)
    if cell.steps is None:
        for axis, _ in cell.variant:
            for name, (value, source) in axis_named(axis).run_overrides(config.run).items():
                run = replace(config.run, **{name: value})
                config = replace(config, run=run, sources={**config.sources, f"run.{name}": source})
    return ResolvedCell(cell, load_task(cell.task, plays=plays), method_class, config)


def usable_cells(cells: Iterable[Cell], log: Log) -> list[Cell]:
    """Return the cells whose task and method can be used in this Python; log what is left out, a line per reason."""
    given = list(cells)
    tasks = usable_tasks(dict.fromkeys(cell.task for cell in given), log)
    methods = usable_methods(dict.fromkeys(cell.method for cell in given), log)
    return [cell for cell in given if cell.task in tasks and cell.method in methods]


def resolve_cells(cells: Sequence[Cell], *, plays: bool = True) -> list[ResolvedCell]:
    """Resolve every cell; check that methods have the overridden settings and that tasks can have the variants.

    With `plays=False`, they can be described, but not run.

    Raises:
        UserError: a check fails; names the first.
    """
    methods = [load_method(name) for name in dict.fromkeys(cell.method for cell in cells)]
    for overrides in dict.fromkeys(cell.overrides for cell in cells):
        check_overrides(overrides, methods)
    for task_name, variant in dict.fromkeys((cell.task, cell.variant) for cell in cells):
        for axis, value in variant:
            axis_named(axis).check(value, load_task(task_name))
    return [resolve_cell(cell, plays=plays) for cell in cells]
