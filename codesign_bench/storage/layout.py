"""The layout of a results folder: names of files, the marker file, and the locks of running cells.

OUT/codesign-bench.json                                  marks a results folder
OUT/<task>/<method>/<variant>/seed-00/cell.json          status, configuration with sources, versions, host, timings
                                     /curve.csv          one row per evaluation
                                     /metrics.csv        the method's metrics, averaged between evaluations
                                     /evaluation.csv     final design, return and success on each evaluation instance
                                     /policy.safetensors final networks
                                     /checkpoint.safetensors, progress.json, cell.lock, output.log   while it runs
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import filelock

from codesign_bench.errors import UserError
from codesign_bench.storage.files import write_bytes, write_json
from codesign_bench.storage.records import CELL_FILE

MARKER_FILE = "codesign-bench.json"
LAYOUT_SCHEMA = 1
"""Version of the folder layout; cell files have their own version."""
CURVE_FILE = "curve.csv"
METRICS_FILE = "metrics.csv"
EVALUATION_FILE = "evaluation.csv"
POLICY_FILE = "policy.safetensors"
CHECKPOINT_FILE = "checkpoint.safetensors"
PROGRESS_FILE = "progress.json"
LOCK_FILE = "cell.lock"
LOG_FILE = "output.log"

CELL_PATTERN = f"*/*/*/seed-*/{CELL_FILE}"
CURVE_COLUMNS = ("env_steps", "wall_s", "return_mean", "return_se", "success_rate", "episode_length")


def open_folder(out: Path) -> None:
    """Make `out` a results folder, or check that it is one.

    Raises:
        UserError: it is not writable, or contains other files.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
        ours = (out / MARKER_FILE).exists() or any(out.glob(CELL_PATTERN))
        if not ours and any(out.iterdir()):
            raise UserError(f"--out {out}: the folder contains files other than results; choose an empty or new folder")
        write_json(out / MARKER_FILE, {"schema": LAYOUT_SCHEMA, "content": "results of codesign-bench run"})
    except OSError as error:
        raise UserError(f"--out {out}: not writable ({error.strerror})") from error


def write_rows(path: Path, rows: Sequence[Mapping[str, Any]], columns: Sequence[str] = ()) -> None:
    """Replace the CSV file `path` by `rows`; `columns` come first and are written even without rows."""
    write_bytes(path, rows_bytes(rows, columns))


def rows_bytes(rows: Sequence[Mapping[str, Any]], columns: Sequence[str] = ()) -> bytes:
    """Return the content of the CSV file that `write_rows` writes."""
    names = list(dict.fromkeys((*columns, *(name for row in rows for name in row))))
    table = io.StringIO()
    writer = csv.DictWriter(table, names, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return table.getvalue().encode()


def cell_lock(folder: Path) -> filelock.BaseFileLock:
    """Return the lock of the cell in `folder`, held by the process that runs the cell."""
    return filelock.FileLock(folder / LOCK_FILE)


def is_locked(folder: Path) -> bool:
    """Return whether a process is running the cell in `folder`."""
    if not (folder / LOCK_FILE).exists():
        return False
    lock = cell_lock(folder)
    try:
        lock.acquire(timeout=0)
    except filelock.Timeout:
        return True
    except OSError:  # a read-only folder, in which nothing can run
        return False
    lock.release()
    return False
