"""The cells of a results folder."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from codesign_bench.config.run_settings import EVALUATION
from codesign_bench.errors import UserError
from codesign_bench.storage.layout import CELL_PATTERN, CURVE_FILE, POLICY_FILE
from codesign_bench.storage.locks import is_locked
from codesign_bench.storage.records import CELL_FILE, DONE, INTERRUPTED, RUNNING, CellRecord


@dataclass(frozen=True)
class StoredCell:
    """A cell on disk: its folder, and its record at the time of reading."""

    folder: Path
    record: CellRecord

    @cached_property
    def status(self) -> str:
        """`DONE`, `FAILED`, `RUNNING` or `INTERRUPTED`."""
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
        return (self.folder / POLICY_FILE).exists()

    def last_evaluation(self) -> dict[str, float]:
        """Return the last row of its curve, or an empty dictionary if there is none."""
        import pandas as pd  # imported here because it takes a second, which `--help` need not pay

        try:
            return {str(name): float(value) for name, value in pd.read_csv(self.folder / CURVE_FILE).iloc[-1].items()}
        except (OSError, ValueError, IndexError):
            return {}


def open_cell(folder: str | Path) -> StoredCell:
    """Return the cell in `folder`.

    Raises:
        UserError: it is not a cell folder, or its record is damaged.
    """
    folder = Path(folder)
    record = CellRecord.read(folder)
    if record is None:
        raise UserError(f"'{folder}' is not a cell folder (no {CELL_FILE})")
    return StoredCell(folder, record)


def find_cells(out: Path) -> Iterator[StoredCell]:
    """Yield every cell below `out`, in order of path; unreadable cells are skipped.

    Raises:
        UserError: the folder does not exist.
    """
    if not out.is_dir():
        raise UserError(f"no results folder '{out}'; create it with: codesign-bench run --out {out}")
    for path in sorted(out.glob(CELL_PATTERN)):
        try:
            yield open_cell(path.parent)
        except UserError:
            continue


def reported_cells(out: Path) -> Iterator[StoredCell]:
    """Yield the cells below `out` that results include: all but those that were evaluated on validation instances.

    Raises:
        UserError: the folder does not exist.
    """
    return (cell for cell in find_cells(out) if cell.is_reported)
