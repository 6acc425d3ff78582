"""The cells of a results folder as the page tells them: how far each is, and why some failed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from codesign_bench.console import duration
from codesign_bench.errors import UserError
from codesign_bench.registry import names
from codesign_bench.storage.results import CELL_PATTERN, DEFAULT_VARIANT, FAILED, LABEL_COLUMN, cell_status, find_cells
from codesign_bench.storage.status import status_row

from .tables import NOTHING, Table, listed

NEEDED = ("versions", "host", "timings")
"""Parts of every cell file, besides its configuration, that the page reads from."""


@dataclass(frozen=True)
class CellRecord:
    """One cell: its path below the results folder, its cell file, and its status, "interrupted" among them."""

    name: str
    content: dict[str, Any]
    status: str
    row: tuple[str, ...]
    """As `codesign-bench status` shows it."""

    @property
    def task(self) -> str:
        """The task's name."""
        return str(self.content["task"])

    @property
    def method(self) -> str:
        """The method's name."""
        return str(self.content["method"])

    @property
    def variant(self) -> str:
        """The variant's name."""
        return str(self.content["variant"])

    @property
    def label(self) -> str:
        """The method's name in figures."""
        return str(self.content.get(LABEL_COLUMN, self.method))


@dataclass(frozen=True)
class Failure:
    """Why a cell failed: a line, and the traceback."""

    cell: str
    message: str
    traceback: str


def read_cells(results: Path) -> tuple[list[CellRecord], list[str]]:
    """Return every cell below `results`, and the names of those whose cell file is damaged or none of ours.

    Raises:
        UserError: there is no such folder, or no cell in it.
    """
    cells, whole = [], set()
    for folder, content in find_cells(results):
        if _is_complete(content):
            status = cell_status(folder, content)
            name = folder.relative_to(results).as_posix()
            cells.append(CellRecord(name, content, status, status_row(results, folder, content, status)))
            whole.add(folder)
    damaged = [path.parent for path in sorted(results.glob(CELL_PATTERN)) if path.parent not in whole]
    if not cells:
        raise UserError(f"no cells in '{results}' yet; make some with: codesign-bench run --out {results}")
    return cells, [folder.relative_to(results).as_posix() for folder in damaged]


def _is_complete(content: dict[str, Any]) -> bool:
    """Tell whether a cell file has all that the page and `status` read from it."""
    try:
        entries = [entry for part in ("run", "method") for entry in content["config"][part].values()]
        int(content["config"]["run"]["steps"]["value"]), int(content["env_steps"])
        described = all({"value", "source"} <= set(entry) for entry in entries)
    except (KeyError, TypeError, ValueError, AttributeError):
        return False
    return described and "profile" in content and all(isinstance(content.get(name), dict) for name in NEEDED)


def in_order(kind: str, found: Iterable[str]) -> list[str]:
    """Return the `found` names of `kind` ("methods" or "tasks") in the order of listings, unknown ones last."""
    present, known = set(found), names(kind)
    return [name for name in known if name in present] + sorted(present - set(known))


def variants(cells: Sequence[CellRecord]) -> list[str]:
    """Return the variants of the cells, `default` first."""
    return sorted({cell.variant for cell in cells}, key=lambda variant: (variant != DEFAULT_VARIANT, variant))


def counts(cells: Sequence[CellRecord]) -> str:
    """Return how many cells there are of each status, e.g. "28 done, 2 failed"."""
    counted = Counter(cell.status for cell in cells)
    return ", ".join(f"{count} {status}" for status, count in sorted(counted.items()))


def status_table(cells: Sequence[CellRecord]) -> Table:
    """Return how many cells of each method there are, by status: one row per task and variant."""
    methods = in_order("methods", (cell.method for cell in cells))
    rows = []
    for task in in_order("tasks", (cell.task for cell in cells)):
        for variant in variants([cell for cell in cells if cell.task == task]):
            group = [cell for cell in cells if (cell.task, cell.variant) == (task, variant)]
            by_method = [counts([cell for cell in group if cell.method == method]) or NOTHING for method in methods]
            rows.append((task, variant, *by_method))
    return Table(("task", "variant", *methods), rows)


def cell_table(cells: Sequence[CellRecord]) -> Table:
    """Return one row per cell, as `codesign-bench status` shows it, and how long it took."""
    rows = [(*cell.row, _wall_time(cell.content["timings"])) for cell in cells]
    header = ("cell", "status", "steps", "of", "return", "success", "time")
    return Table(header, rows, numeric=frozenset(header[2:]))


def failures(cells: Sequence[CellRecord]) -> list[Failure]:
    """Return why each failed cell failed."""
    found = []
    for cell in cells:
        if cell.status == FAILED:
            told = cell.content.get("failure") or {}
            found.append(Failure(cell.name, str(told.get("message", "")), str(told.get("traceback", ""))))
    return found


def facts(results: Path, cells: Sequence[CellRecord]) -> list[tuple[str, str]]:
    """Return what the folder holds, as names and values."""
    seeds = sorted({int(cell.content["seed"]) for cell in cells})
    return [
        ("results", str(results)),
        ("cells", f"{len(cells)}: {counts(cells)}"),
        ("tasks", ", ".join(in_order("tasks", (cell.task for cell in cells)))),
        ("methods", ", ".join(in_order("methods", (cell.method for cell in cells)))),
        ("variants", listed(variants(cells), most=12)),
        ("seeds", listed([str(seed) for seed in seeds], most=12)),
        ("profiles", ", ".join(sorted({str(cell.content["profile"]) for cell in cells}))),
    ]


def _wall_time(timings: dict[str, Any]) -> str:
    seconds = timings.get("wall_s")
    return NOTHING if seconds is None else duration(float(seconds))
