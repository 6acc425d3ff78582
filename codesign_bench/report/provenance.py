"""Provenance of the results: configurations with sources, code, versions, machines and times."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

from codesign_bench.config.settings import METHOD, RUN
from codesign_bench.console import duration
from codesign_bench.registry import in_order
from codesign_bench.storage.provenance import NOT_RECORDED, code, processor

from .cells import PageCell
from .tables import NOTHING, Table, listed

ALL_CELLS = "all"
OWN = "codesign_bench"
"""Among the versions of a cell: that of the code itself."""


@dataclass(frozen=True)
class Configuration:
    """A method's settings in all its cells."""

    method: str
    label: str
    table: Table


def configurations(cells: Sequence[PageCell]) -> list[Configuration]:
    """Return every method's configuration: one row per setting, or one per value if cells differ."""
    found = []
    for method in in_order("methods", (cell.method for cell in cells)):
        group = [cell for cell in cells if cell.method == method]
        rows = [row for part in (RUN, METHOD) for row in _setting_rows(group, part)]
        found.append(Configuration(method, group[0].label, Table(("setting", "value", "source", "cells"), rows)))
    return found


def code_table(cells: Sequence[PageCell]) -> Table:
    """Return the commits that cells were made by, with the cells of each."""
    groups = _grouped(
        cells, lambda cell: (str(cell.record.versions.get(OWN, NOT_RECORDED)), code(cell.record.conditions))
    )
    return Table(("codesign-bench", "commit", "cells"), [(*told, where(group, cells)) for told, group in groups])


def version_table(cells: Sequence[PageCell]) -> Table:
    """Return the versions of tasks and packages that cells record, with the cells where they differ."""
    packages = dict.fromkeys(name for cell in cells for name in cell.record.versions if name != OWN)
    tasks = _grouped(cells, lambda cell: (cell.task, str(cell.record.task_version)))
    rows = [(f"task {task}", version, where(group, cells)) for (task, version), group in tasks]
    for name in packages:

        def version(cell: PageCell, name: str = name) -> str:
            return str(cell.record.versions.get(name, NOT_RECORDED) or "not installed")

        rows += [(name, found, where(group, cells)) for found, group in _grouped(cells, version)]
    return Table(("task or package", "version", "cells"), rows)


def machine_table(cells: Sequence[PageCell]) -> Table:
    """Return the machines of the cells."""

    def facts_of(cell: PageCell) -> tuple[str, ...]:
        host = cell.record.host
        return str(host.get("name")), str(host.get("system")), processor(cell.record.conditions), str(host.get("cores"))

    rows = []
    for facts, group in _grouped(cells, facts_of):
        threads = sorted({str(cell.record.host.get("threads")) for cell in group})
        rows.append((*facts, ", ".join(threads), str(len(group))))
    header = ("machine", "system", "processor", "cores", "threads per cell", "cells")
    return Table(header, rows, numeric=frozenset(header[3:]))


def time_table(cells: Sequence[PageCell]) -> Table:
    """Return, per task and method, the median and total time of finished cells."""
    rows = []
    for task in in_order("tasks", (cell.task for cell in cells)):
        for method in in_order("methods", (cell.method for cell in cells if cell.task == task)):
            group = [cell.record.timings for cell in cells if (cell.task, cell.method) == (task, method)]
            walls = [timings.wall_s for timings in group if timings.wall_s is not None]
            training = _median(timings.train_s for timings in group)
            evaluation = _median(timings.evaluate_s for timings in group)
            rows.append(
                (task, method, str(len(walls)), training, evaluation, duration(sum(walls)) if walls else NOTHING)
            )
    header = ("task", "method", "cells", "training, median", "evaluation, median", "total")
    return Table(header, rows, numeric=frozenset(header[2:]))


def period(cells: Sequence[PageCell]) -> str:
    """Return the time from the first cell's start to the last one's end."""
    started = [cell.record.timings.started or "" for cell in cells]
    ended = [cell.record.timings.ended or "" for cell in cells]
    first, last = min(filter(None, started), default=NOTHING), max(filter(None, ended), default="not ended yet")
    return f"{_moment(first)} to {_moment(last)}"


def where(group: Sequence[PageCell], everything: Sequence[PageCell]) -> str:
    """Describe briefly which of the cells `everything` are in `group`: by task, variant or method if one of these
    distinguishes them from the others, else by name."""
    chosen = {cell.name for cell in group}
    others = [cell for cell in everything if cell.name not in chosen]
    if not others:
        return ALL_CELLS
    keys: dict[str, Callable[[PageCell], str]] = {
        "tasks": lambda cell: cell.task,
        "methods": lambda cell: cell.method,
        "variants": lambda cell: cell.variant,
    }
    for key in keys.values():
        if not {key(cell) for cell in group} & {key(cell) for cell in others}:
            return listed(sorted({key(cell) for cell in group}))
    return listed(sorted(chosen), most=2)


def _setting_rows(cells: Sequence[PageCell], part: str) -> Iterable[tuple[str, ...]]:
    """Yield setting, value, source and cells; cells older than a setting do not have it."""
    settings = dict.fromkeys(name for cell in cells for name in cell.record.config.parts[part])
    for name in settings:
        having = [cell for cell in cells if name in cell.record.config.parts[part]]

        def entry(cell: PageCell, name: str = name) -> tuple[str, str]:
            value, source = cell.record.config.parts[part][name]
            return _shown(value), source

        for (value, source), group in _grouped(having, entry):
            yield name, value, source, where(group, cells)


def _grouped(cells: Sequence[PageCell], key: Callable[[PageCell], Any]) -> list[tuple[Any, list[PageCell]]]:
    """Return the cells grouped by `key`, in order of first occurrence."""
    groups: dict[Any, list[PageCell]] = {}
    for cell in cells:
        groups.setdefault(key(cell), []).append(cell)
    return list(groups.items())


def _shown(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def _median(seconds: Iterable[float | None]) -> str:
    known = [value for value in seconds if value is not None]
    return duration(median(known)) if known else NOTHING


def _moment(text: str) -> str:
    """Return a time of a cell file, which is UTC, to the minute."""
    return f"{text[:10]} {text[11:16]} UTC" if text[10:11] == "T" else text
