"""What a search for settings will take, before it runs.

The settings of a method differ in their speed, and there are hundreds of them. So one stands for all of a method on a
task: the first, whose speed is known from a finished cell, or measured.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from rich.console import Console

from codesign_bench.cell.cell import ResolvedCell, resolve_cell
from codesign_bench.console import duration, print_table, printer, tell
from codesign_bench.machine import available_cores
from codesign_bench.storage.cells import find_cells
from codesign_bench.study.tuning import Tuning
from codesign_bench.sweep.estimate import START_SECONDS, known_paces
from codesign_bench.sweep.pace import Kind, NotTimed, Pace, kind_of, measure, remember
from codesign_bench.tuning.settings import budgets_of, settings_of

EVALUATIONS = 2
"""Of a cell: at its start and its end."""


@dataclass(frozen=True)
class Part:
    """The search for one method on one task, and what is left of it."""

    task: str
    method: str
    cells: int
    """Cells that are not done."""
    env_steps: int
    """Their budgets together."""
    pace: Pace | None
    """None: unknown."""

    @property
    def seconds(self) -> float | None:
        """How long its cells take one after the other."""
        if self.pace is None:
            return None
        return self.cells * START_SECONDS + self.pace.seconds(self.env_steps, EVALUATIONS * self.cells)


@dataclass(frozen=True)
class Expected:
    """What is left of a search."""

    parts: list[Part]
    jobs: int

    @property
    def seconds(self) -> float | None:
        """How long the parts of known speed take; None: there are none."""
        known = [part.seconds for part in self.parts if part.seconds is not None]
        return sum(known) / self.jobs if known else None

    @property
    def unknown(self) -> int:
        """Cells of unknown speed."""
        return sum(part.cells for part in self.parts if part.pace is None)

    def line(self) -> str:
        """Return cells, steps and time as one line."""
        cells, steps = sum(part.cells for part in self.parts), sum(part.env_steps for part in self.parts)
        time = "unknown time (--dry-run measures it)"
        if self.seconds is not None:
            time = f"about {duration(self.seconds)} with {self.jobs} at a time"
            time += f" and {self.unknown:,} cells of unknown speed" * (self.unknown > 0)
        return f"to run: at most {cells:,} cells, {steps:,} environment steps, {time}"

    def to_json(self) -> dict[str, Any]:
        """Return the same as an event for programs."""
        return {
            "to_run": sum(part.cells for part in self.parts),
            "steps": sum(part.env_steps for part in self.parts),
            "jobs": self.jobs,
            "expected_seconds": self.seconds,
            "cells_of_unknown_speed": self.unknown,
        }


def print_plan(console: Console, tuning: Tuning, profile: str, steps: int | None) -> None:
    """Print the rungs of the search on every task, the same for every method, and the steps of each method."""
    budgets = {task: budgets_of(tuning, task, profile, steps) for task in tuning.tasks}
    rows = [
        (task, str(rung), str(size), f"{budget:,}", f"{size * budget * len(tuning.seeds):,}")
        for task in tuning.tasks
        for rung, (size, budget) in enumerate(zip(tuning.sizes, budgets[task], strict=True))
    ]
    log = printer(console)
    print_table(console, ("task", "rung", "settings", "steps of a cell", "steps of a method"), rows)
    each = sum(tuning.steps(budgets[task]) for task in tuning.tasks)
    cells = sum(tuning.sizes) * len(tuning.seeds) * len(tuning.tasks) * len(tuning.methods)
    log(
        f"the same for {', '.join(tuning.methods)}: {each:,} steps each, {each * len(tuning.methods):,} in all, "
        f"in {cells:,} cells"
    )


def samples(tuning: Tuning, profile: str, steps: int | None) -> dict[tuple[str, str], ResolvedCell]:
    """Return (task, method) -> the cell that stands for the search of the method on the task."""
    found = {}
    for task, method in product(tuning.tasks, tuning.methods):
        budget = budgets_of(tuning, task, profile, steps)[-1]
        first, *_ = settings_of(tuning, task, method, profile)
        found[task, method] = resolve_cell(first.cells(tuning, 0, profile, budget)[0])
    return found


def expected(
    tuning: Tuning,
    profile: str,
    steps: int | None,
    out: Path,
    jobs: int | None,
    known: Mapping[Kind, Pace] | None = None,
) -> Expected:
    """Return what is left of a search in the results folder `out`; cells that are done are taken off."""
    known, done = known_paces(out) if known is None else known, _done(out)
    parts = []
    for (task, method), cell in samples(tuning, profile, steps).items():
        budgets = budgets_of(tuning, task, profile, steps)
        count, taken = done.get((task, method), (0, 0))
        cells = sum(tuning.sizes) * len(tuning.seeds) - count
        left = max(tuning.steps(budgets) - taken, 0)
        parts.append(Part(task, method, max(cells, 0), left, known.get(kind_of(cell))))
    return Expected(parts, max(1, min(jobs or available_cores(), available_cores())))


def dry_run(console: Console, tuning: Tuning, profile: str, steps: int | None, out: Path, jobs: int | None) -> int:
    """Print the plan of a search and how long each part takes; parts of unknown speed are timed, some seconds each."""
    say, known = printer(console), known_paces(out)
    print_plan(console, tuning, profile, steps)
    for cell in samples(tuning, profile, steps).values():
        if kind_of(cell) not in known:
            say(f"timing {cell.cell.task}/{cell.cell.method} ...")
            try:
                known[kind_of(cell)] = measure(cell)[0]
                remember({kind_of(cell): known[kind_of(cell)]})
            except NotTimed as error:
                say(str(error))
    found = expected(tuning, profile, steps, out, jobs, known)
    rows = [
        (part.task, part.method, f"{part.cells:,}", f"{part.env_steps:,}", *_time(part, found.jobs))
        for part in found.parts
    ]
    print_table(console, ("task", "method", "cells", "steps", "time", "known from"), rows)
    if not tell(console, "plan", **found.to_json()):
        say(found.line())
    say("nothing was run")
    return 0


def _time(part: Part, jobs: int) -> Iterable[str]:
    if part.seconds is None or part.pace is None:
        return "unknown", ""
    return duration(part.seconds / jobs), part.pace.source


def _done(out: Path) -> dict[tuple[str, str], tuple[int, int]]:
    """Return (task, method) -> how many finished cells there are, and their budgets together."""
    found: dict[tuple[str, str], tuple[int, int]] = {}
    for cell in find_cells(out) if out.is_dir() else ():
        if cell.is_done:
            key = cell.record.task, cell.record.method
            count, steps = found.get(key, (0, 0))
            found[key] = count + 1, steps + int(cell.record.config.run["steps"].value)
    return found
