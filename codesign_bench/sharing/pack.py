"""Pack finished cells and tables of a results folder into an archive: `codesign-bench pack`."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from codesign_bench.cell.variant import DEFAULT
from codesign_bench.code_version import code_version
from codesign_bench.console import Log
from codesign_bench.errors import UserError
from codesign_bench.storage.archive import SUFFIX, files_in, limit_of, write_archive
from codesign_bench.storage.cells import StoredCell, find_cells, scan
from codesign_bench.storage.files import saying_why
from codesign_bench.storage.layout import CURVE_FILE, EVALUATION_FILE, MARKER_FILE, POLICY_FILE
from codesign_bench.storage.manifest import LONGEST_NOTE, Manifest
from codesign_bench.storage.records import CELL_FILE, CellRecord
from codesign_bench.storage.reference_points import FILE as REFERENCE_POINTS_FILE
from codesign_bench.storage.survey import lines, survey

COUNT = re.compile(r"\d{1,15}")
OF_A_BRIEF_CELL = tuple(f"/{name}" for name in (CELL_FILE, CURVE_FILE, EVALUATION_FILE))
BRIEF = (MARKER_FILE, REFERENCE_POINTS_FILE)
"""What a brief archive has of a cell, and beside the cells."""
NO_CODE: Mapping[str, Any] = {"version": None, "commit": None, "changed": None, "fingerprint": None}
"""The code of a cell of version 0.1.0, which records none."""


@dataclass(frozen=True)
class Order:
    """What goes into an archive beside the results, and what stays out."""

    title: str = ""
    by: str = ""
    note: str = ""
    tuning: Sequence[str] = ()
    """Folders of `codesign-bench tune`, whose steps are counted, and words."""
    brief: bool = False
    """Whether only what the leaderboard needs goes along: cells of the default variant without policies and metrics,
    and reference points."""


def pack(results: Path, out: Path, order: Order, log: Log) -> Manifest:
    """Write the finished cells and the tables of a results folder to the archive `out`, and return its manifest.

    Cells that are not finished, were evaluated on validation instances or have a damaged file stay out; `log` names
    them, and damaged tables.

    Args:
        results: a results folder.
        out: a file that does not exist yet, whose name ends in `.zip`.
        order: what goes along.
        log: prints a line for each part that stays out.

    Raises:
        UserError: there is no finished cell, `out` exists or cannot be written, or a text of `order` is too long.
    """
    if out.suffix.lower() != SUFFIX:
        raise UserError(f"--out {out}: the name must end in {SUFFIX}")
    if os.path.lexists(out):
        raise UserError(f"--out {out}: the file exists, and no archive is replaced; choose another name")
    for name in ("title", "by", "note"):
        if len(getattr(order, name)) > LONGEST_NOTE:
            raise UserError(f"--{name}: longer than {LONGEST_NOTE} characters")
    tuning_steps, tuning_note = spent_on_tuning(order.tuning)
    contents = scan(results)
    unusable = survey(results, contents)
    for line in lines(results, unusable):
        log(f"left out: {line}")
    cells = []
    for cell in contents.cells:
        if reason := _stays_out(cell, order):
            log(f"left out: {cell.folder.relative_to(results).as_posix()}: {reason}")
        elif not cell.problems and _wanted(cell, order):
            cells.append(cell)
    if not cells:
        raise UserError(f"no finished cell in '{results}' to pack")
    damaged = {problem.path for problem in unusable}
    names = [name for name in _names(results, cells, order, log) if results / name not in damaged]
    manifest = manifest_of(
        [cell.record for cell in cells],
        title=order.title or results.resolve().name,
        by=order.by,
        note=order.note,
        policies=sum(name.endswith(f"/{POLICY_FILE}") for name in names),
        tuning_note=tuning_note,
        tuning_steps=tuning_steps,
    )
    with saying_why("--out", out):
        out.parent.mkdir(parents=True, exist_ok=True)
        return write_archive(out, results, names, manifest)


def manifest_of(records: Sequence[CellRecord], **entries: Any) -> Manifest:
    """Return the manifest of cells with these records, without files; `entries` are its others."""
    codes: dict[str, dict[str, Any]] = {}
    for record in records:
        code = {name: record.code.get(name) for name in NO_CODE}
        codes.setdefault(repr(code), {**code, "cells": 0})["cells"] += 1
    packages = dict.fromkeys(name for record in records for name in record.versions)
    return Manifest(
        ended=max((record.timings.ended or "" for record in records), default=""),
        cells=len(records),
        packed_by=code_version().to_json(),
        code=tuple(sorted(codes.values(), key=lambda code: -code["cells"])),
        versions={
            name: Counter(record.versions.get(name) or "not installed" for record in records) for name in packages
        },
        **entries,
    )


def spent_on_tuning(given: Sequence[str]) -> tuple[dict[str, dict[str, int]], str]:
    """Return the environment steps of searches by task and method, and what is said of them in words.

    Args:
        given: folders of `codesign-bench tune`, whose cells are counted; a number of steps; anything else is words.

    Raises:
        UserError: a folder has no cells, or the words are too long.
    """
    steps: dict[str, dict[str, int]] = {}
    words = []
    for tuning in given:
        if not os.path.isdir(tuning):
            words.append(f"{int(tuning):,} steps" if COUNT.fullmatch(tuning) else tuning)
            continue
        found = [cell.record for cell in find_cells(Path(tuning))]
        if not found:
            raise UserError(f"--tuning {tuning}: no cells of a search in this folder")
        for record in found:
            of_task = steps.setdefault(record.task, {})
            of_task[record.method] = of_task.get(record.method, 0) + record.env_steps
    note = "; ".join(words)
    if len(note) > LONGEST_NOTE:
        raise UserError(f"--tuning: longer than {LONGEST_NOTE} characters")
    return steps, note


def _stays_out(cell: StoredCell, order: Order) -> str:
    """Return why a cell that could be expected in an archive is not, or nothing."""
    if not _wanted(cell, order):
        return ""
    if not cell.is_done:
        return f"it is {cell.status}"
    return "" if cell.is_reported else "it was evaluated on validation instances"


def _wanted(cell: StoredCell, order: Order) -> bool:
    return cell.record.variant == DEFAULT or not order.brief


def _names(results: Path, cells: Sequence[StoredCell], order: Order, log: Log) -> list[str]:
    """Return the files that go along, as paths below the results folder."""
    folders = [cell.folder.relative_to(results).as_posix() for cell in cells]
    names = []
    for name in files_in(results, folders):
        if limit_of(name) is None:
            log(f"left out: {name}: an archive cannot have a file of this name")
        elif not order.brief or name in BRIEF or name.endswith(OF_A_BRIEF_CELL):
            names.append(name)
    return names
