"""Run a stored cell again from its `cell.json`, and say whether its curve is the same: `codesign-bench rerun`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pandas as pd
from rich.console import Console

from codesign_bench.cell.cell import Cell, ResolvedCell, resolve_cell, resolve_cells
from codesign_bench.config.settings import METHOD, RUN, plain
from codesign_bench.console import Log, printer
from codesign_bench.errors import UserError
from codesign_bench.storage.cells import DEPTH, StoredCell, open_cell
from codesign_bench.storage.provenance import differences
from codesign_bench.storage.records import CELL_FILE, CellRecord
from codesign_bench.sweep.runner import EXIT_ALL_DONE, dry_run, run_sweep

TIME = "wall_s"
"""The column of a curve that differs between runs of the same cell."""
NOW, BEFORE = "now", "before"


def rerun(given: Path, out: Path, *, console: Console, jobs: int | None = None, only_plan: bool = False) -> int:
    """Run the cell in a folder, or of a cell file, again in the results folder `out`; return 0, or 1 if it failed.

    A cell that starts from the policy of another one has that run again first. With `only_plan`, nothing is run.

    Raises:
        UserError: there is no such cell, or this version cannot run it with the configuration that it has stored.
    """
    stored, say = _opened(given), printer(console)
    if _results_of(stored).resolve() == out.resolve():
        raise UserError(f"--out {out}: holds the cell itself, which runs again elsewhere; choose another folder")
    chain = _with_pretrained(stored)
    cells = [cell_of(each) for each in chain]
    if only_plan:
        return dry_run(resolve_cells(cells), out, console=console, jobs=jobs)
    for cell in cells:
        if (code := run_sweep(resolve_cells([cell]), out, console=console, jobs=jobs)) != EXIT_ALL_DONE:
            return code
    for each, cell in zip(chain, cells, strict=True):
        _compare(each, open_cell(cell.folder(out)), say)
    return EXIT_ALL_DONE


def cell_of(stored: StoredCell) -> Cell:
    """Return the cell that has the stored configuration now, whatever the profile or a default says today.

    Raises:
        UserError: there is none: its task has changed, or a setting is gone or no longer allowed.
    """
    record = stored.record
    steps = int(record.config.run["steps"].value)
    cell = Cell(record.task, record.method, record.seed, record.variant, record.profile, steps)
    overrides = _overrides(record, resolve_cell(cell))
    cell = replace(cell, overrides=tuple(overrides))
    if different := resolve_cell(cell).differences(record.config, record.task_version):
        raise UserError(f"{stored.folder} cannot run again as it was: {'; '.join(different)}")
    return cell


def _overrides(record: CellRecord, resolved: ResolvedCell) -> list[str]:
    """Return what must be set, in the form of `--set`, for the values that the record has."""
    today, found = resolved.config.stored(), []
    for part, prefix, values in (
        (RUN, RUN, resolved.config.run),
        (METHOD, record.method, resolved.config.method),
    ):
        defaults, before = type(values)(), record.config.parts[part]
        for name in (field.name for field in fields(values)):
            # A setting that did not exist when the cell ran had what is now the class's default.
            wanted = before[name].value if name in before else plain(getattr(defaults, name))
            if wanted != today.parts[part][name].value:
                found.append(f"{prefix}.{name}={_text(wanted)}")
    return found


def _text(value: Any) -> str:
    """Return a stored value as `--set` takes it."""
    return ",".join(map(str, value)) if isinstance(value, list) else str(value)


def _opened(given: Path) -> StoredCell:
    return open_cell(given.parent if given.name == CELL_FILE else given)


def _results_of(stored: StoredCell) -> Path:
    """Return the results folder that a cell lies in."""
    return Path(*stored.folder.absolute().parts[:-DEPTH])


def _with_pretrained(stored: StoredCell) -> list[StoredCell]:
    """Return the stored cell after those that it starts from, which lie in the same results folder."""
    record = stored.record
    before = Cell(record.task, record.method, record.seed, record.variant).pretrained
    if before is None:
        return [stored]
    return [*_with_pretrained(open_cell(before.folder(_results_of(stored)))), stored]


def _compare(before: StoredCell, now: StoredCell, say: Log) -> None:
    """Say whether two runs of a cell have the same curve, where they part, and what was different."""
    curves = [cell.curve() for cell in (before, now)]
    first, second = (None if curve is None else curve.drop(columns=TIME) for curve in curves)
    if first is None or second is None:
        return say(f"there is no former curve to compare with in {before.folder}")
    shared = min(len(first), len(second))
    row = _first_difference(first[:shared], second[:shared])
    if row is None and len(second) >= len(first):
        return say(f"the same curve as before, digit for digit, in all of its {len(first)} rows")
    if row is None:
        return say(f"the curve has {len(second)} rows, {len(first)} before; those are the same")
    say(_parting(row, first, second))
    for line in differences({BEFORE: [before.record], NOW: [now.record]}):
        say(line)
    return None


def _first_difference(one: pd.DataFrame, other: pd.DataFrame) -> int | None:
    """Return the first row in which two tables differ in a column that both have, or None."""
    names = _shared(one, other)
    same = (one[names].to_numpy() == other[names].to_numpy()) | (one[names].isna() & other[names].isna()).to_numpy()
    rows = (~same).any(axis=1).nonzero()[0]
    return int(rows[0]) if rows.size else None


def _shared(one: pd.DataFrame, other: pd.DataFrame) -> list[str]:
    return [str(name) for name in one.columns if name in other.columns]


def _parting(row: int, one: pd.DataFrame, other: pd.DataFrame) -> str:
    pairs: Sequence[str] = [
        f"{name} {one[name].iloc[row]} before, {other[name].iloc[row]} now"
        for name in _shared(one, other)
        if one[name].iloc[row] != other[name].iloc[row]
    ]
    return f"the curve differs from before, from row {row + 1} of {len(one)} on: {'; '.join(pairs)}"
