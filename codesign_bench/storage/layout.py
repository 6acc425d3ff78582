"""The layout of a results folder: names of files, the marker file, and what a killed process leaves behind.

::

  OUT/codesign-bench.json                                  marks a results folder
  OUT/archive.json                                         marks an unpacked archive, which is only read
  OUT/<task>/<method>/<variant>/seed-00/cell.json          status, configuration with sources, versions, host, timings
                                       /curve.csv          one row per evaluation
                                       /metrics.csv        the method's metrics, averaged between evaluations
                                       /evaluation.csv     final design, return, success on each evaluation instance
                                       /policy.safetensors final networks
                                       /checkpoint.safetensors, progress.json, cell.lock, output.log   while it runs
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from codesign_bench.errors import UserError
from codesign_bench.storage.checkpoint import remove_checkpoint
from codesign_bench.storage.files import dump_json, is_partial, partial_pattern, remove_partial_files, write_bytes
from codesign_bench.storage.locks import HOLDER_FILE, LOCK_FILE, locked
from codesign_bench.storage.records import CELL_FILE

MARKER_FILE = "codesign-bench.json"
ARCHIVE_FILE = "archive.json"
"""The manifest of an archive; a folder that has it is only read."""
LAYOUT_SCHEMA = 1
"""Version of the folder layout; cell files have their own version."""
CURVE_FILE = "curve.csv"
METRICS_FILE = "metrics.csv"
EVALUATION_FILE = "evaluation.csv"
POLICY_FILE = "policy.safetensors"
CHECKPOINT_FILE = "checkpoint.safetensors"
PROGRESS_FILE = "progress.json"
LOG_FILE = "output.log"
WHILE_RUNNING = (CHECKPOINT_FILE, PROGRESS_FILE, LOG_FILE, HOLDER_FILE, LOCK_FILE)
"""Files that a cell has only until it is done; its lock comes last."""
OF_THE_SYSTEM = (".DS_Store", "Thumbs.db", "desktop.ini", "lost+found")
"""Files in folders that users would call empty."""

CELL_PATTERN = f"*/*/*/seed-*/{CELL_FILE}"
CURVE_COLUMNS = ("env_steps", "wall_s", "return_mean", "return_se", "success_rate", "episode_length")


def open_folder(out: Path) -> None:
    """Make `out` a results folder, or check that it is one; several processes may do so at the same time.

    Raises:
        UserError: it is not writable, is an archive, or contains other files.
    """
    refuse_archive(out)
    try:
        out.mkdir(parents=True, exist_ok=True)
        refuse_other_files(out)
        _mark(out)
    except OSError as error:
        raise UserError(f"--out {out}: not writable ({error.strerror})") from error


def first_run(out: str | Path) -> str:
    """Return a command that writes first results into the folder `out`."""
    return f"codesign-bench run --method all --task all --profile quick --out {out}"


def refuse_archive(out: Path) -> None:
    """Check that results may be written into a folder.

    Raises:
        UserError: it is an unpacked archive, whose checksums hold only as long as nothing is added.
    """
    if os.path.exists(out / ARCHIVE_FILE):
        raise UserError(f"'{out.name}' is an archive of results, which is only read; give a results folder of your own")


def refuse_other_files(out: Path) -> None:
    """Check that the folder `out` contains nothing but results.

    Raises:
        UserError: it contains other files.
        OSError: it is not a folder, or cannot be read.
    """
    ours = is_marked(out) or any(out.glob(CELL_PATTERN))
    # Another process may mark the folder after the first look and fill it before this one: hence the second look.
    if not ours and any(not _is_leftover(entry.name) for entry in out.iterdir()) and not is_marked(out):
        raise UserError(f"--out {out}: the folder contains files other than results; choose an empty or new folder")


def is_marked(folder: Path) -> bool:
    """Return whether a folder is marked as one with results."""
    return (folder / MARKER_FILE).exists()


def _is_leftover(name: str) -> bool:
    """Return whether a file in a folder without a marker is nobody's content."""
    return is_partial(name) or name.startswith(".nfs") or name in OF_THE_SYSTEM


def _mark(out: Path) -> None:
    """Write the marker file unless it is complete, and remove those that versions up to 0.1.0 left unfinished."""
    marker = out / MARKER_FILE
    # Written in place: a file with a temporary name that is renamed could be left behind by a kill. The file's
    # existence marks the folder, so an empty one does no harm, and the next process completes it.
    if not marker.exists() or marker.stat().st_size == 0:
        content = dump_json({"schema": LAYOUT_SCHEMA, "content": "results of codesign-bench run"}, indent=2)
        marker.write_text(content + "\n")
    for leftover in out.glob(partial_pattern(MARKER_FILE)):
        leftover.unlink(missing_ok=True)


def sweep_leftovers(folder: Path) -> None:
    """Remove what a killed process left of a finished cell in `folder`, unless another process holds its lock.

    A file that cannot be removed stays; nothing depends on it.
    """
    with suppress(OSError):  # also the lock's timeout
        if any(folder.glob(partial_pattern())) or any((folder / name).exists() for name in WHILE_RUNNING):
            with locked(folder):
                remove_leftovers(folder)


def remove_leftovers(folder: Path) -> None:
    """Remove the files of a finished cell that only a running one needs; call it only while holding its lock.

    Raises:
        OSError: a file cannot be removed.
    """
    remove_partial_files(folder)
    remove_checkpoint(folder / CHECKPOINT_FILE)
    for name in WHILE_RUNNING:
        (folder / name).unlink(missing_ok=True)


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
