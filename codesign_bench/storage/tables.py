"""Tables of measurements that are stored next to the cells."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from codesign_bench.storage.files import write_bytes
from codesign_bench.storage.layout import open_folder

if TYPE_CHECKING:
    import pandas as pd


def csv_bytes(table: pd.DataFrame) -> bytes:
    """Return a table as the content of a CSV file, the same on every system."""
    return table.to_csv(index=False, lineterminator="\n").encode()


def read_table(path: Path) -> pd.DataFrame | None:
    """Return the table in `path`, or None if there is none."""
    import pandas as pd

    return pd.read_csv(path) if path.exists() else None


def write_table(results: Path, path: Path, table: pd.DataFrame) -> None:
    """Replace the table in `path`, below the results folder `results`.

    Raises:
        UserError: the folder is not writable, or contains other files than results.
    """
    open_folder(results)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(path, csv_bytes(table))
