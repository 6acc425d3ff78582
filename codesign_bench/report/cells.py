"""The cells of a results folder for the page: their progress, and why some failed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from codesign_bench.cell.variant import DEFAULT_NAME
from codesign_bench.console import duration
from codesign_bench.errors import UserError
from codesign_bench.registry import in_order
from codesign_bench.storage.cells import scan
from codesign_bench.storage.layout import first_run
from codesign_bench.storage.places import shown
from codesign_bench.storage.records import CellRecord, Timings
from codesign_bench.storage.status import status_row
from codesign_bench.storage.survey import lines, survey

from .tables import NOTHING, Table, listed


@dataclass(frozen=True)
class PageCell:
    """One cell: its path below the results folder, its record, and its line in `codesign-bench status`."""

    name: str
    record: CellRecord
    status: str
    row: tuple[str, ...]

    @property
    def task(self) -> str:
        """The task's name."""
        return self.record.task

    @property
    def method(self) -> str:
        """The method's name."""
        return self.record.method

    @property
    def variant(self) -> str:
        """The variant's name."""
        return self.record.variant.name

    @property
    def label(self) -> str:
        """The method's name in figures."""
        return self.record.label


@dataclass(frozen=True)
class CellFailure:
    """Why a cell failed."""

    cell: str
    message: str
    traceback: str


def read_cells(results: Path) -> tuple[list[PageCell], list[str]]:
    """Return every reported cell below `results`, and each file that cannot be used with its reason.

    Raises:
        UserError: the folder does not exist or contains no cells.
    """
    contents = scan(results)
    cells = [
        PageCell(cell.folder.relative_to(results).as_posix(), cell.record, cell.status, status_row(results, cell))
        for cell in contents.cells
        if cell.is_reported
    ]
    if not cells:
        raise UserError(f"no cells in '{results}' yet; create some with: {first_run(results)}")
    return cells, lines(results, survey(results, contents))


def variants(cells: Sequence[PageCell]) -> list[str]:
    """Return the variants of the cells, `default` first."""
    return sorted({cell.variant for cell in cells}, key=lambda variant: (variant != DEFAULT_NAME, variant))


def counts(cells: Sequence[PageCell]) -> str:
    """Return the number of cells per status, e.g. "28 done, 2 failed"."""
    counted = Counter(cell.status for cell in cells)
    return ", ".join(f"{count} {status}" for status, count in sorted(counted.items()))


def status_table(cells: Sequence[PageCell]) -> Table:
    """Return the number of cells per method and status, one row per task and variant."""
    methods = in_order("methods", (cell.method for cell in cells))
    rows = []
    for task in in_order("tasks", (cell.task for cell in cells)):
        for variant in variants([cell for cell in cells if cell.task == task]):
            group = [cell for cell in cells if (cell.task, cell.variant) == (task, variant)]
            by_method = [counts([cell for cell in group if cell.method == method]) or NOTHING for method in methods]
            rows.append((task, variant, *by_method))
    return Table(("task", "variant", *methods), rows)


def cell_table(cells: Sequence[PageCell]) -> Table:
    """Return one row per cell, as in `codesign-bench status`, with its duration."""
    rows = [(*cell.row, _wall_time(cell.record.timings)) for cell in cells]
    header = ("cell", "status", "steps", "of", "return", "success", "time")
    return Table(header, rows, numeric=frozenset(header[2:]))


def failures(cells: Sequence[PageCell]) -> list[CellFailure]:
    """Return why each failed cell failed."""
    return [
        CellFailure(cell.name, cell.record.failure.message, cell.record.failure.traceback)
        for cell in cells
        if cell.record.failure is not None
    ]


def facts(results: Path, cells: Sequence[PageCell]) -> list[tuple[str, str]]:
    """Return facts about the folder as names and values."""
    seeds = sorted({cell.record.seed for cell in cells})
    return [
        ("results", shown(results)),
        ("cells", f"{len(cells)}: {counts(cells)}"),
        ("tasks", ", ".join(in_order("tasks", (cell.task for cell in cells)))),
        ("methods", ", ".join(in_order("methods", (cell.method for cell in cells)))),
        ("variants", listed(variants(cells), most=12)),
        ("seeds", listed([str(seed) for seed in seeds], most=12)),
        ("profiles", ", ".join(sorted({cell.record.profile for cell in cells}))),
    ]


def _wall_time(timings: Timings) -> str:
    return NOTHING if timings.wall_s is None else duration(timings.wall_s)
