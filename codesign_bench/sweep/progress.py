"""Show the progress of a sweep: a live table on a terminal, plain lines elsewhere."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.live import Live
from rich.table import Table

from codesign_bench.cell.cell import Cell
from codesign_bench.console import duration, number, printer
from codesign_bench.storage.json_fields import number as json_number
from codesign_bench.storage.layout import PROGRESS_FILE
from codesign_bench.storage.reading import UnusableFile, read_json

POLL_SECONDS = 1.0
LINE_SECONDS = 10.0


@dataclass(frozen=True)
class Snapshot:
    """The progress of a sweep."""

    running: list[tuple[Cell, dict[str, Any]]]
    finished: int
    cells: int
    steps_per_second: float
    seconds_left: float | None
    """None while the speed is unknown."""

    def line(self) -> str:
        """Return the progress as one line of text."""
        left = "time left unknown" if self.seconds_left is None else f"about {duration(self.seconds_left)} left"
        counts = f"{self.finished}/{self.cells} cells ended, {len(self.running)} running"
        return f"{counts}, {self.steps_per_second:,.0f} steps/s, {left}"


class ProgressDisplay:
    """A thread that polls the cells' progress files; a context manager around the sweep."""

    def __init__(self, console: Console, out: Path, budgets: dict[Cell, int]) -> None:
        self._console, self.out, self._budgets = console, out, budgets
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
        printer(self._console)(line)

    def ended(self, cell: Cell) -> None:
        """Count `cell` as ended."""
        self._remaining.pop(cell, None)

    def snapshot(self) -> Snapshot:
        """Return the current progress of the sweep."""
        remaining = dict(self._remaining)
        running = [(cell, found) for cell in remaining if (found := self._read(cell)) is not None]
        speed = sum(found["steps_per_second"] for _, found in running)
        steps_left = sum(remaining.values()) - sum(found["env_steps"] for _, found in running)
        return Snapshot(
            running=running,
            finished=len(self._budgets) - len(remaining),
            cells=len(self._budgets),
            steps_per_second=speed,
            seconds_left=max(steps_left, 0) / speed if speed > 0.0 else None,
        )

    def _read(self, cell: Cell) -> dict[str, Any] | None:
        try:
            found = read_json(cell.folder(self.out) / PROGRESS_FILE)
            for name in ("updated", "env_steps", "steps", "steps_per_second"):
                json_number(found, name)
            return dict(found) if found["updated"] >= self._since else None
        except (OSError, UnusableFile, ValueError, KeyError, TypeError, AttributeError):
            return None

    def _poll(self) -> None:
        next_line = time.monotonic() + LINE_SECONDS
        while not self._stop.wait(POLL_SECONDS):
            if self._live is not None:
                self._live.update(progress_table(self.snapshot()), refresh=True)
            elif time.monotonic() >= next_line:
                next_line += LINE_SECONDS
                self.say(self.snapshot().line())


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
