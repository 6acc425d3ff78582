"""Cells per hour on this machine: cells of a task and method train side by side for some seconds, and are projected.

The projection of a profile is its budget at the speed measured with that profile's settings, plus its evaluations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median

from rich.console import Console

from codesign_bench.benchmarks.output import write_speeds
from codesign_bench.cell.cell import Cell, ResolvedCell, resolve_cell
from codesign_bench.console import duration, print_table, printer
from codesign_bench.machine import available_cores
from codesign_bench.sweep.pace import NotTimed, Pace, measure

HEADER = ("cell", "profile", "at a time", "steps/s each", "steps/s together", "a cell", "cells/hour", "MB each")


@dataclass(frozen=True)
class Projection:
    """A profile's cells of one task and method, side by side."""

    task: str
    method: str
    profile: str
    device: str
    at_a_time: int
    steps_per_second: float
    """Of one cell, the median over those side by side."""
    together: float
    """Of all of them, environment steps/s."""
    cell_s: float
    """How long a cell takes, evaluations included."""
    cells_per_hour: float
    peak_mb: float
    """Of the largest."""


def project(resolved: ResolvedCell, paces: Sequence[Pace]) -> Projection:
    """Return what these paces of cells side by side mean for whole cells."""
    cell, run = resolved.cell, resolved.config.run
    seconds = [pace.seconds(run.steps, 1 + run.evaluations) for pace in paces]
    return Projection(
        task=cell.task,
        method=cell.method,
        profile=cell.profile,
        device=run.device,
        at_a_time=len(paces),
        steps_per_second=median(pace.steps_per_second for pace in paces),
        together=sum(pace.steps_per_second for pace in paces),
        cell_s=median(seconds),
        cells_per_hour=sum(3600.0 / each for each in seconds),
        peak_mb=max(pace.peak_mb or 0.0 for pace in paces),
    )


def bench_sweep(
    tasks: Sequence[str],
    methods: Sequence[str],
    profiles: Sequence[str],
    overrides: Sequence[str],
    jobs: int | None,
    out: Path | None,
    console: Console,
) -> None:
    """Measure every task with every method and profile, print a table, and write it to `out` as JSON, if given.

    Args:
        tasks: names of tasks.
        methods: names of methods.
        profiles: names of profiles.
        overrides: `key=value` entries of `--set`, e.g. the device.
        jobs: cells side by side; None: one per core.
        out: JSON file.
        console: where the table goes.

    Raises:
        UserError: an unknown name, an invalid setting, or a file that is not writable.
    """
    say, found = printer(console), []
    chosen = [
        resolve_cell(Cell(task, method, seed=0, profile=profile, overrides=tuple(overrides)))
        for task in tasks
        for method in methods
        for profile in profiles
    ]
    for resolved in chosen:
        cell = resolved.cell
        at_a_time = jobs or max(1, available_cores() // resolved.config.run.threads)
        say(f"measuring {cell.task}/{cell.method}, profile {cell.profile}, {at_a_time} at a time ...")
        try:
            found.append(project(resolved, measure(resolved, at_a_time)))
        except NotTimed as error:
            say(f"left out: {error}")
    print_table(console, HEADER, [_row(each) for each in found])
    say(f"on {available_cores()} cores; each cell trained for some seconds and was evaluated once")
    write_speeds(out, {"sweep": [asdict(each) for each in found]}, 1, say)


def _row(found: Projection) -> tuple[str, ...]:
    return (
        f"{found.task}/{found.method}",
        found.profile,
        str(found.at_a_time),
        f"{found.steps_per_second:,.0f}",
        f"{found.together:,.0f}",
        duration(found.cell_s),
        f"{found.cells_per_hour:.1f}",
        f"{found.peak_mb:.0f}",
    )
