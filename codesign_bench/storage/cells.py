"""The cells of a results folder: good ones, and what of the folder cannot be used, with file and reason.

Every command reads cells through this module, so that all of them leave out the same files.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from codesign_bench.cell.cell import Cell
from codesign_bench.config.run_settings import EVALUATION
from codesign_bench.errors import UserError
from codesign_bench.storage.files import reason_of
from codesign_bench.storage.layout import (
    CURVE_COLUMNS,
    CURVE_FILE,
    EVALUATION_FILE,
    METRICS_FILE,
    POLICY_FILE,
    first_run,
)
from codesign_bench.storage.locks import is_locked
from codesign_bench.storage.places import cell_folder
from codesign_bench.storage.reading import DamagedFile, UnreadableFile, UnusableFile, is_folder, is_there, read_bytes
from codesign_bench.storage.records import CELL_FILE, DONE, INTERRUPTED, RUNNING, CellRecord
from codesign_bench.storage.tables import TABLE_BYTES, Content, Form, checksum, read_table

if TYPE_CHECKING:
    import pandas as pd

DEPTH = 4
"""Folders of cells are so many levels below a results folder: task, method, variant, seed."""
SEED = "seed-"
"""The names of cells' folders begin with it; those of copies need not."""
DAMAGED = "damaged"
"""Not stored: the status of a finished cell with a file that is missing or damaged."""
OF_A_CELL = (CELL_FILE, CURVE_FILE, METRICS_FILE, EVALUATION_FILE, POLICY_FILE)
"""Files that show that a folder without a cell file was a cell's."""
CHECKED = (CURVE_FILE, EVALUATION_FILE)
"""Tables that a finished cell has; its record has their checksums."""

CURVE_FORM = Form(
    {**dict.fromkeys(CURVE_COLUMNS, Content.NUMBER), "env_steps": Content.WHOLE, "success_rate": Content.SHARE},
    rising="env_steps",
)
EVALUATION_FORM = Form(
    {
        **dict.fromkeys(("return", "material", "effort", "instance_*", "design_*"), Content.NUMBER),
        "success": Content.SHARE,
        "episode_length": Content.WHOLE,
        "in_cutout*": Content.SHARE,
    }
)
SUMMARIES = {"return": "return_mean", "success": "success_rate", "episode_length": "episode_length"}
"""Column of an evaluation -> column of the curve with its mean."""
SAME = 1e-6
"""Relative difference below which two means are the same, however they were summed."""


@dataclass(frozen=True)
class StoredCell:
    """A cell on disk: its folder, and its record at the time of reading."""

    folder: Path
    record: CellRecord

    @property
    def name(self) -> str:
        """Its path below a results folder, e.g. `push/gnn_ppo/default/seed-00`."""
        return _name(self.record)

    @cached_property
    def status(self) -> str:
        """`DONE`, `FAILED`, `RUNNING`, `INTERRUPTED` or `DAMAGED`."""
        if self.is_done and self.problems:
            return DAMAGED
        interrupted = self.record.status == RUNNING and not is_locked(self.folder)
        return INTERRUPTED if interrupted else self.record.status

    @property
    def is_done(self) -> bool:
        """Whether the cell is finished."""
        return self.record.status == DONE

    @property
    def is_reported(self) -> bool:
        """Whether it was evaluated on evaluation instances; cells of tuning were not, and no result includes them."""
        instances = self.record.config.run.get("instances")
        return instances is None or instances.value == EVALUATION

    @property
    def has_policy(self) -> bool:
        """Whether its final policy is stored; some shipped cells omit it."""
        return is_there(self.folder / POLICY_FILE)

    def curve(self) -> pd.DataFrame | None:
        """Return its curve, or None if it was not evaluated yet; do not change the table, which is read once.

        Raises:
            UnusableFile: it is damaged or cannot be read, or the cell is done and has none.
        """
        return self._curve

    def evaluation(self) -> pd.DataFrame | None:
        """Return its last evaluation, one row per instance, or None if the cell is not done yet.

        Raises:
            UnusableFile: it is damaged or cannot be read, or the cell is done and has none.
        """
        table = self._table(EVALUATION_FILE, EVALUATION_FORM)
        if table is not None and self.is_done and EVALUATION_FILE not in self.record.checksums:
            self._compare_with_curve(table)
        return table

    def last_evaluation(self) -> dict[str, float]:
        """Return the last row of its curve, or an empty dictionary if there is none that can be read."""
        return self._last_evaluation

    @cached_property
    def _curve(self) -> pd.DataFrame | None:
        return self._table(CURVE_FILE, CURVE_FORM)

    @cached_property
    def _last_evaluation(self) -> dict[str, float]:
        try:
            curve = self.curve()
        except UnusableFile:
            return {}
        if curve is None:
            return {}
        return {str(name): float(value) for name, value in curve.select_dtypes("number").iloc[-1].items()}

    @cached_property
    def problems(self) -> list[UnusableFile]:
        """What of its files cannot be used."""
        found = []
        for read in (self.curve, self.evaluation, self._check_policy):
            try:
                read()
            except UnusableFile as error:
                found.append(error)
        return found

    def _table(self, name: str, form: Form) -> pd.DataFrame | None:
        table = read_table(self.folder / name, form, self.record.checksums.get(name) if self.is_done else None)
        if table is None and self.is_done:
            raise DamagedFile(self.folder / name, "it is missing, although the cell is done")
        return table

    def _compare_with_curve(self, evaluation: pd.DataFrame) -> None:
        """Check a cell without checksums: the last row of its curve is the mean of the evaluation's rows."""
        ends = self.last_evaluation()
        for name, end in SUMMARIES.items():
            mean, last = float(evaluation[name].mean()), ends.get(end)
            if last is not None and abs(mean - last) > SAME * max(abs(last), 1.0):
                reason = f"its mean {name} is {mean:.6g}, that of the last row of {CURVE_FILE} {last:.6g}"
                raise DamagedFile(self.folder / EVALUATION_FILE, reason)

    def _check_policy(self) -> None:
        from codesign_bench.storage.arrays import check_arrays  # needs safetensors, which `--help` need not

        if self.has_policy:
            check_arrays(self.folder / POLICY_FILE)


@dataclass(frozen=True)
class Contents:
    """The cells of a results folder, and the files by which others cannot be read."""

    cells: list[StoredCell]
    unusable: list[UnusableFile]


def table_checksums(folder: Path) -> dict[str, str]:
    """Return the checksums of the tables of a cell that has ended, for its record."""
    return {name: checksum(read_bytes(folder / name, TABLE_BYTES)) for name in CHECKED}


def open_cell(folder: str | Path) -> StoredCell:
    """Return the cell in `folder`, which may be in an archive or in the shipped results; see `places`.

    Raises:
        UserError: it is not a cell folder, or its record is damaged.
    """
    folder = cell_folder(folder)
    record = CellRecord.read(folder)
    if record is None:
        raise UserError(f"'{folder}' is not a cell folder (no {CELL_FILE})")
    return StoredCell(folder, record)


def stored_record(cell: Cell, out: Path) -> CellRecord | None:
    """Return the record of `cell` in the results folder `out`, or None if there is none.

    Raises:
        UnusableFile: it cannot be read, or is that of another cell.
    """
    record = CellRecord.read(cell.folder(out))
    if record is not None:
        _check_place(record, cell.folder(out), cell.name)
    return record


def scan(out: Path) -> Contents:
    """Return every cell below `out`, in order of path, and what stands in the place of others.

    A cell in another cell's folder, such as a copy, is not among the cells.

    Raises:
        UserError: the folder does not exist.
    """
    if not is_folder(out):
        raise UserError(f"no results folder '{out}'; create it with: {first_run(out)}")
    contents = Contents([], [])
    for folder in _at_depth(out, DEPTH, contents.unusable):
        try:
            if (record := _record_in(folder)) is not None:
                _check_place(record, folder, folder.relative_to(out).as_posix())
                contents.cells.append(StoredCell(folder, record))
        except UnusableFile as error:
            contents.unusable.append(error)
    return contents


def find_cells(out: Path) -> Iterator[StoredCell]:
    """Yield every cell below `out`, in order of path; `scan` says what is left out.

    Raises:
        UserError: the folder does not exist.
    """
    return iter(scan(out).cells)


def reported_cells(out: Path) -> Iterator[StoredCell]:
    """Yield the cells below `out` that results include: all but those that were evaluated on validation instances.

    Raises:
        UserError: the folder does not exist.
    """
    return (cell for cell in find_cells(out) if cell.is_reported)


def _at_depth(folder: Path, depth: int, unusable: list[UnusableFile]) -> Iterator[Path]:
    """Yield what is `depth` levels below a folder, in order; folders that cannot be listed go to `unusable`."""
    try:
        names = sorted(os.listdir(folder)) if is_folder(folder) else []
    except OSError as error:
        unusable.append(UnreadableFile(folder, reason_of(error)))
        return
    except UnusableFile as error:
        unusable.append(error)
        return
    for name in names:
        if depth == 1:
            yield folder / name
        else:
            yield from _at_depth(folder / name, depth - 1, unusable)


def _record_in(folder: Path) -> CellRecord | None:
    """Return the record in what may be a cell's folder, or None if it is none.

    Raises:
        UnusableFile: it cannot be read, or is missing where other files of a cell are.
    """
    if not is_folder(folder):
        if folder.name.startswith(SEED):
            raise DamagedFile(folder, "it is not a folder")
        return None
    record = CellRecord.read(folder)
    if record is None and _lacks_its_record(folder):
        raise DamagedFile(folder / CELL_FILE, "it is missing, although the folder has a cell's files")
    return record


def _check_place(record: CellRecord, folder: Path, name: str) -> None:
    """Check that a record is that of the folder's cell.

    Raises:
        DamagedFile: it is another cell's.
    """
    own = _name(record)
    if own != name:
        raise DamagedFile(folder / CELL_FILE, f"it is that of the cell {own}, so it is a copy and does not count")


def _lacks_its_record(folder: Path) -> bool:
    """Return whether a folder without a cell file has files that only a cell has, while no process runs it."""
    return any(is_there(folder / name) for name in OF_A_CELL) and not is_locked(folder)


def _name(record: CellRecord) -> str:
    return Cell(record.task, record.method, record.seed, record.variant).name
