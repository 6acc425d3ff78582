"""Results on disk: the names of files and columns, and reading them all as one tidy frame.

OUT/codesign-bench.json                                  marks the folder as ours
OUT/<task>/<method>/<variant>/seed-00/cell.json          status, configuration with sources, versions, host, timings
                                     /curve.csv          one row per evaluation
                                     /metrics.csv        the method's own metrics, averaged between evaluations
                                     /evaluation.csv     each evaluation instance at the end: design, return, success
                                     /policy.safetensors final networks
                                     /checkpoint.safetensors, progress.json, cell.lock, output.log   while it runs
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import filelock

from codesign_bench.errors import UserError
from codesign_bench.storage.files import write_bytes, write_json

if TYPE_CHECKING:  # pandas takes a second to import, which every cell's process would pay
    import pandas as pd

MARKER_FILE = "codesign-bench.json"
CELL_FILE = "cell.json"
CURVE_FILE = "curve.csv"
METRICS_FILE = "metrics.csv"
EVALUATION_FILE = "evaluation.csv"
POLICY_FILE = "policy.safetensors"
CHECKPOINT_FILE = "checkpoint.safetensors"
PROGRESS_FILE = "progress.json"
LOCK_FILE = "cell.lock"
LOG_FILE = "output.log"

CELL_PATTERN = f"*/*/*/seed-*/{CELL_FILE}"
SCHEMA = 1

CURVE_COLUMNS = ("env_steps", "wall_s", "return_mean", "return_se", "success_rate", "episode_length")
CELL_COLUMNS = ("task", "method", "variant", "cutout", "alpha", "seed")
DEFAULT_VARIANT = "default"
"""Of a cell that differs in nothing from what its task and profile say."""
LABEL_COLUMN = "label"
"""The method's name in figures, added beside the columns that tell the cell."""

RUNNING, DONE, FAILED = "running", "done", "failed"
INTERRUPTED = "interrupted"
"""Not stored: a cell that says it is running while no process holds its lock."""


def read_cell(folder: Path) -> dict[str, Any] | None:
    """Return the content of the cell file in `folder`, or None when there is none.

    Raises:
        UserError: it is none of ours, or damaged.
    """
    path = folder / CELL_FILE
    try:
        content = json.loads(path.read_text())
        if content["status"] not in (RUNNING, DONE, FAILED) or not isinstance(content["config"], dict):
            raise ValueError("unknown status")
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError, OSError) as error:
        raise UserError(f"cannot read {path} ({error}); delete its folder to start the cell again") from error
    return dict(content)


def write_cell(folder: Path, content: Mapping[str, Any]) -> None:
    """Replace the cell file in `folder`."""
    write_json(folder / CELL_FILE, content)


def write_rows(path: Path, rows: Sequence[Mapping[str, Any]], columns: Sequence[str] = ()) -> None:
    """Replace the CSV file `path` by `rows`; `columns` come first and are there even without rows."""
    names = list(dict.fromkeys((*columns, *(name for row in rows for name in row))))
    table = io.StringIO()
    writer = csv.DictWriter(table, names, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_bytes(path, table.getvalue().encode())


def cell_lock(folder: Path) -> filelock.BaseFileLock:
    """Return the lock that the process running the cell in `folder` holds."""
    return filelock.FileLock(folder / LOCK_FILE)


def is_locked(folder: Path) -> bool:
    """Tell whether some process is running the cell in `folder` now."""
    if not (folder / LOCK_FILE).exists():
        return False
    lock = cell_lock(folder)
    try:
        lock.acquire(timeout=0)
    except filelock.Timeout:
        return True
    except OSError:  # a folder that may only be read: nobody runs anything there
        return False
    lock.release()
    return False


def cell_status(folder: Path, content: Mapping[str, Any]) -> str:
    """Return "done", "failed", "running" or "interrupted"."""
    status = str(content["status"])
    return INTERRUPTED if status == RUNNING and not is_locked(folder) else status


def open_folder(out: Path) -> None:
    """Make `out` a results folder, or check that it is one.

    Raises:
        UserError: it cannot be written, or holds something else.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
        ours = (out / MARKER_FILE).exists() or any(out.glob(CELL_PATTERN))
        if not ours and any(out.iterdir()):
            raise UserError(f"--out {out}: the folder holds other files than results; choose an empty or a new folder")
        write_json(out / MARKER_FILE, {"schema": SCHEMA, "content": "results of codesign-bench run"})
    except OSError as error:
        raise UserError(f"--out {out}: cannot write there ({error.strerror})") from error


def find_cells(out: Path) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Yield folder and cell file of every cell below `out`, in order of path; foreign files are passed over.

    Raises:
        UserError: there is no such folder.
    """
    if not out.is_dir():
        raise UserError(f"no results folder '{out}'; make one with: codesign-bench run --out {out}")
    for path in sorted(out.glob(CELL_PATTERN)):
        try:
            content = read_cell(path.parent)
        except UserError:
            continue
        if content is not None and all(name in content for name in CELL_COLUMNS):
            yield path.parent, content


def load_results(out: str | Path) -> pd.DataFrame:
    """Return every evaluation of every cell below `out`, running and failed ones included, as one tidy frame.

    Columns: task, method, variant, cutout, alpha (NaN where absent), seed, label, then those of `curve.csv`.

    Raises:
        UserError: there is no such folder, or no result in it.
    """
    import pandas as pd

    frames = [frame for folder, content in find_cells(Path(out)) if (frame := _read_curve(folder, content)) is not None]
    if not frames:
        raise UserError(f"no results in '{out}' yet; make some with: codesign-bench run --out {out}")
    frame = pd.concat(frames, ignore_index=True)
    return frame.astype({"cutout": float, "alpha": float, "seed": int, "env_steps": int})


def load_evaluations(out: str | Path) -> pd.DataFrame:
    """Return what every finished cell below `out` reached on each evaluation instance, as one tidy frame.

    Columns: those of `CELL_COLUMNS` and `label`, then `instance` (its number), `instance_<name>` and `design_<name>` in
    the task's units (NaN for the entries of other tasks), return, success, episode_length, material, effort, and
    in_cutout where the task has positions.

    Raises:
        UserError: there is no such folder, or no finished cell in it.
    """
    import pandas as pd

    frames = []
    for folder, content in find_cells(Path(out)):
        if content["status"] == DONE and (folder / EVALUATION_FILE).exists():
            table = pd.read_csv(folder / EVALUATION_FILE)
            table.insert(0, "instance", range(len(table)))
            frames.append(_with_cell_columns(table, content))
    if not frames:
        raise UserError(f"no finished cell in '{out}' yet; make some with: codesign-bench run --out {out}")
    return pd.concat(frames, ignore_index=True).astype({"cutout": float, "alpha": float, "seed": int})


def _with_cell_columns(table: pd.DataFrame, content: Mapping[str, Any]) -> pd.DataFrame:
    """Put what tells the cell in front of a table's own columns."""
    for position, name in enumerate(CELL_COLUMNS):
        value = content[name]
        table.insert(position, name, float("nan") if value is None else value)
    table.insert(len(CELL_COLUMNS), LABEL_COLUMN, content.get(LABEL_COLUMN, content["method"]))
    return table


def _read_curve(folder: Path, content: Mapping[str, Any]) -> pd.DataFrame | None:
    import pandas as pd

    try:
        curve = pd.read_csv(folder / CURVE_FILE)
    except (OSError, ValueError):  # not evaluated yet, or no table
        return None
    if curve.empty or not set(CURVE_COLUMNS) <= set(curve.columns):
        return None
    return _with_cell_columns(curve, content)
