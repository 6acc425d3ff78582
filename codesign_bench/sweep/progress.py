"""Show the progress of a sweep: a live table on a terminal, plain lines elsewhere."""

from __future__ import annotations

import heapq
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from rich.console import Console
from rich.live import Live
from rich.table import Table

from codesign_bench.cell.cell import Cell
from codesign_bench.console import duration, number, printer, tell
from codesign_bench.errors import UserError
from codesign_bench.storage.records import DONE, CellRecord
from codesign_bench.storage.status import read_progress

POLL_SECONDS = 1.0
LINE_SECONDS = 10.0
Kind: TypeAlias = tuple[str, str]
"""Task and method."""


@dataclass(frozen=True)
class Snapshot:
    """The progress of a sweep."""

    running: list[tuple[Cell, dict[str, Any]]]
    finished: int
    cells: int
    steps_per_second: float
    """Of the cells that train; 0 while cells start."""
    seconds_left: float | None
    """None while no speed is known."""
    unknown: int = 0
    """Cells that the time left does not include, since no cell of their kind has trained yet."""

    def line(self) -> str:
        """Return the progress as one line of text."""
        parts = [f"{self.finished}/{self.cells} cells ended, {len(self.running)} running"]
        if self.steps_per_second > 0.0:
            parts.append(f"{self.steps_per_second:,.0f} steps/s")
        elif self.finished < self.cells:
            parts.append("cells are starting")
        return ", ".join([*parts, self._left()])

    def to_json(self) -> dict[str, Any]:
        """Return the progress as an event for programs."""
        names = ("phase", "env_steps", "steps", "steps_per_second", "return_mean", "success_rate")
        running = [{"cell": cell.name, **{name: found.get(name) for name in names}} for cell, found in self.running]
        return {
            "cells": self.cells,
            "ended": self.finished,
            "running": running,
            "steps_per_second": self.steps_per_second,
            "seconds_left": self.seconds_left,
            "cells_of_unknown_speed": self.unknown,
        }

    def _left(self) -> str:
        if self.seconds_left is None:
            return "time left unknown"
        if self.unknown:
            return f"at least {duration(self.seconds_left)} left, and {self.unknown} cells of unknown speed"
        return f"about {duration(self.seconds_left)} left"


class Speeds:
    """How fast cells train, for each kind of cell: methods and tasks differ by more than a factor of ten."""

    def __init__(self) -> None:
        self._ended: dict[Kind, tuple[float, float]] = {}
        """Environment steps and seconds of the cells that have ended."""

    def add(self, cell: Cell, env_steps: float, seconds: float) -> None:
        """Take a cell that has ended into account."""
        before = self._ended.get(kind_of(cell), (0.0, 0.0))
        self._ended[kind_of(cell)] = (before[0] + env_steps, before[1] + seconds)

    def of(self, running: Sequence[tuple[Cell, dict[str, Any]]]) -> dict[Kind, float]:
        """Return steps per second of every kind that is known: of ended cells, or else the mean of running ones."""
        now: dict[Kind, list[float]] = {}
        for cell, found in running:
            if found["steps_per_second"] > 0.0:
                now.setdefault(kind_of(cell), []).append(found["steps_per_second"])
        known = {kind: sum(speeds) / len(speeds) for kind, speeds in now.items()}
        return known | {kind: steps / s for kind, (steps, s) in self._ended.items() if steps > 0.0 and s > 0.0}


def kind_of(cell: Cell) -> Kind:
    """Return what a cell's speed depends on most."""
    return cell.task, cell.method


def seconds_until_done(seconds: Sequence[float], workers: int) -> float:
    """Return how long cells take that last so many `seconds` each, in this order, on so many workers."""
    ends = [0.0] * max(1, workers)
    for duration_of_cell in seconds:
        heapq.heapreplace(ends, ends[0] + duration_of_cell)
    return max(ends)


class ProgressDisplay:
    """A thread that polls the cells' progress files; a context manager around the sweep."""

    def __init__(self, console: Console, out: Path, budgets: dict[Cell, int], workers: int = 1) -> None:
        self.console, self.out, self.budgets, self._workers = console, out, budgets, workers
        self._speeds = Speeds()
        self._remaining = dict(budgets)
        self._since = time.time()
        self._stop = threading.Event()
        self._live = Live(console=console, auto_refresh=False, transient=True) if console.is_terminal else None
        self._thread = threading.Thread(target=self._poll, daemon=True)

    def __enter__(self) -> ProgressDisplay:
        if self._live is not None:
            self._live.start()
        self._thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._stop.set()
        self._thread.join()
        if self._live is not None:
            self._live.stop()

    def say(self, line: str) -> None:
        """Print a line above the live table."""
        printer(self.console)(line)

    def ended(self, cell: Cell) -> None:
        """Count `cell` as ended, and remember its speed."""
        self._remaining.pop(cell, None)
        with suppress(UserError, OSError):
            record = CellRecord.read(cell.folder(self.out))
            if record is not None and record.status == DONE:
                self._speeds.add(cell, record.env_steps, record.timings.wall_s or 0.0)

    def snapshot(self) -> Snapshot:
        """Return the current progress of the sweep."""
        remaining = dict(self._remaining)
        running = [(cell, found) for cell in remaining if (found := read_progress(cell.folder(self.out), self._since))]
        speeds, taken = self._speeds.of(running), {cell: found["env_steps"] for cell, found in running}
        in_turn = sorted(remaining, key=lambda cell: cell not in taken)  # those that run are ahead of those that wait
        known = [cell for cell in in_turn if kind_of(cell) in speeds]
        seconds = [max(remaining[cell] - taken.get(cell, 0), 0) / speeds[kind_of(cell)] for cell in known]
        return Snapshot(
            running=running,
            finished=len(self.budgets) - len(remaining),
            cells=len(self.budgets),
            steps_per_second=sum(found["steps_per_second"] for _, found in running),
            seconds_left=seconds_until_done(seconds, max(self._workers, len(running))) if known else None,
            unknown=len(remaining) - len(known),
        )

    def _poll(self) -> None:
        next_line = time.monotonic() + LINE_SECONDS
        while not self._stop.wait(POLL_SECONDS):
            if self._live is not None:
                self._live.update(progress_table(self.snapshot()), refresh=True)
            elif time.monotonic() >= next_line:
                next_line += LINE_SECONDS
                snapshot = self.snapshot()
                if not tell(self.console, "progress", **snapshot.to_json()):
                    self.say(snapshot.line())


def progress_table(snapshot: Snapshot) -> Table:
    """Return the live table: one row per running cell, and the total as its caption."""
    table = Table(caption=snapshot.line(), caption_justify="left")
    for heading in ("cell", "phase", "steps", "done", "steps/s", "return", "success"):
        table.add_column(heading, justify="left" if heading in ("cell", "phase") else "right", overflow="fold")
    for cell, found in snapshot.running:
        share = min(found["env_steps"] / found["steps"], 1.0)
        table.add_row(
            cell.name,
            found["phase"],
            f"{found['env_steps']:,}",
            f"{share:.0%}",
            f"{found['steps_per_second']:,.0f}",
            number(found["return_mean"]),
            number(found["success_rate"]),
        )
    return table
