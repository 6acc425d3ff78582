"""What a sweep will take on this machine, before it runs: cells by state, time and memory."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from codesign_bench.console import duration
from codesign_bench.errors import UserError
from codesign_bench.machine import total_gpu_megabytes, total_megabytes
from codesign_bench.storage.cells import find_cells
from codesign_bench.sweep.pace import Kind, Pace, kind_of, measured_before, of_finished
from codesign_bench.sweep.plan import Pending
from codesign_bench.sweep.progress import seconds_until_done

START_SECONDS = 5.0
"""Time in which a cell's process starts (ours)."""
MEMORY_SHARE = 0.8
"""Cells together use at most this share of a memory, unless `--jobs` says otherwise (ours)."""


@dataclass(frozen=True)
class Expected:
    """One cell to be run, and what it will take."""

    pending: Pending
    pace: Pace | None
    """None: no cell of its kind has been timed on this machine."""

    @property
    def state(self) -> str:
        """What the sweep does with it."""
        done, run = self.pending.env_steps, self.pending.resolved.config.run
        return "run" if done == 0 else f"resume at {done / run.steps:.0%}"

    @property
    def seconds(self) -> float | None:
        """How long it will take; None: unknown."""
        if self.pace is None:
            return None
        run = self.pending.resolved.config.run
        left = max(run.steps - self.pending.env_steps, 0)
        return START_SECONDS + self.pace.seconds(left, 1.0 + run.evaluations * left / run.steps)


@dataclass(frozen=True)
class Estimate:
    """What the cells of a sweep take together."""

    cells: list[Expected]
    jobs: int

    @property
    def unknown(self) -> int:
        """Number of cells whose kind has not been timed."""
        return sum(cell.pace is None for cell in self.cells)

    @property
    def seconds(self) -> float:
        """How long the cells take whose pace is known, `jobs` at a time."""
        return seconds_until_done([seconds for cell in self.cells if (seconds := cell.seconds) is not None], self.jobs)

    @property
    def megabytes(self) -> float | None:
        """Most memory of the cells that run at a time; None: of no kind known."""
        peaks = [cell.pace.peak_mb for cell in self.cells if cell.pace is not None and cell.pace.peak_mb is not None]
        return sum(sorted(peaks, reverse=True)[: self.jobs]) if peaks else None

    def to_json(self) -> dict[str, Any]:
        """Return the totals as an event for programs; seconds are those of the cells whose pace is known."""
        known = self.unknown < len(self.cells)
        return {
            "jobs": self.jobs,
            "steps": sum(cell.pending.resolved.config.run.steps - cell.pending.env_steps for cell in self.cells),
            "expected_seconds": self.seconds if known else None,
            "cells_of_unknown_speed": self.unknown,
            "memory_mb": self.megabytes,
        }

    def line(self) -> str:
        """Return the time and the memory as one line."""
        if self.unknown == len(self.cells):
            return "expected time unknown: no cell of these kinds has been timed here yet (--dry-run times one of each)"
        rest = f", and {self.unknown} cells of unknown speed (--dry-run times one of each kind)" if self.unknown else ""
        return f"expected to take {duration(self.seconds)}{rest}{self._memory()}"

    def _memory(self) -> str:
        if self.megabytes is None:
            return ""
        there = total_megabytes()
        return f", up to {gigabytes(self.megabytes)} of memory" + ("" if there is None else f" of {gigabytes(there)}")


def estimate(cells: Sequence[Pending], jobs: int, known: Mapping[Kind, Pace]) -> Estimate:
    """Return what these cells take, given the known paces."""
    return Estimate([Expected(cell, known.get(kind_of(cell.resolved))) for cell in cells], jobs)


def known_paces(out: Path) -> dict[Kind, Pace]:
    """Return the paces of this machine: those of the finished cells in `out`, or else those measured before."""
    try:
        finished = of_finished(cell.record for cell in find_cells(out)) if out.is_dir() else {}
    except (UserError, OSError):
        finished = {}  # the sweep itself says what is wrong
    return {**measured_before(), **finished}


def untimed(cells: Iterable[Pending], known: Mapping[Kind, Pace]) -> dict[Kind, Pending]:
    """Return one cell of each kind whose pace is unknown."""
    kinds: dict[Kind, Pending] = {}
    for cell in cells:
        kinds.setdefault(kind_of(cell.resolved), cell)
    return {kind: cell for kind, cell in kinds.items() if kind not in known}


def fitting(cells: Iterable[Pending], known: Mapping[Kind, Pace]) -> int | None:
    """Return how many of the largest of these cells fit in the memory of this machine and of its GPU; None: unknown."""
    paces = [pace for cell in cells if (pace := known.get(kind_of(cell.resolved))) is not None]
    own = max((pace.peak_mb for pace in paces if pace.peak_mb), default=None)
    on_gpu = max((pace.gpu_mb for pace in paces if pace.gpu_mb), default=None)
    there = [
        (needed, total)
        for needed, total in ((own, total_megabytes()), (on_gpu, total_gpu_megabytes() if on_gpu else None))
        if needed and total
    ]
    return min((max(1, int(MEMORY_SHARE * total / needed)) for needed, total in there), default=None)


def gigabytes(megabytes: float) -> str:
    """Return an amount of memory in GB."""
    return f"{megabytes / 1024.0:.1f} GB"


def event_of(cell: Expected) -> dict[str, Any]:
    """Return the same as `row` for programs."""
    pace, run = cell.pace, cell.pending.resolved.config.run
    return {
        "cell": cell.pending.cell.name,
        "state": cell.state,
        "steps": run.steps,
        "env_steps": cell.pending.env_steps,
        "expected_seconds": cell.seconds,
        "memory_mb": None if pace is None else pace.peak_mb,
        "known_from": None if pace is None else pace.source,
    }


def row(cell: Expected) -> tuple[str, ...]:
    """Return name, state, steps, time and memory of a cell as text, and where the latter two are from."""
    pace, seconds = cell.pace, cell.seconds
    return (
        cell.pending.cell.name,
        cell.state,
        f"{cell.pending.resolved.config.run.steps:,}",
        "unknown" if seconds is None else duration(seconds),
        "unknown" if pace is None or pace.peak_mb is None else gigabytes(pace.peak_mb),
        "" if pace is None else pace.source,
    )
