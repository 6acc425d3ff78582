"""The process of one cell: it holds the cell's lock, runs it, records the outcome, and ends when its parent goes away.

Started by `codesign_bench.sweep.workers` with the numerical libraries' threads already set in its environment.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
import threading
import traceback
from dataclasses import asdict
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import filelock

from codesign_bench.cell.cell import Cell
from codesign_bench.config.resolve import ResolvedConfig, differences
from codesign_bench.errors import UserError
from codesign_bench.machine import host_facts, package_versions
from codesign_bench.method import load_method
from codesign_bench.plugins import import_modules
from codesign_bench.processes import EXIT_ORPHANED
from codesign_bench.storage.checkpoint import remove_checkpoint
from codesign_bench.storage.files import remove_partial_files
from codesign_bench.storage.results import (
    CHECKPOINT_FILE,
    DONE,
    FAILED,
    LABEL_COLUMN,
    LOCK_FILE,
    LOG_FILE,
    PROGRESS_FILE,
    RUNNING,
    SCHEMA,
    cell_lock,
    read_cell,
    write_cell,
)
from codesign_bench.sweep.training import CellRun

EXIT_DONE, EXIT_FAILED, EXIT_REFUSED, EXIT_BUSY = 0, 1, 2, 75
LOCK_SECONDS = 2.0
"""Longer than a look at the lock by `status` takes."""


def main(arguments: list[str] | None = None) -> int:
    """Run the cell that the first argument describes in JSON, below the folder that the second names.

    A third argument `retry` runs a failed cell again. Returns one of the exit codes above.
    """
    cell_json, out, *options = sys.argv[1:] if arguments is None else arguments
    cell = Cell.from_json(cell_json)
    folder = cell.folder(Path(out))
    folder.mkdir(parents=True, exist_ok=True)
    try:
        with cell_lock(folder).acquire(timeout=LOCK_SECONDS):
            return run_locked(cell, folder, retry="retry" in options)
    except filelock.Timeout:
        return EXIT_BUSY


def run_locked(cell: Cell, folder: Path, *, retry: bool) -> int:
    """Run `cell` as the holder of its lock, unless another process was quicker; return the exit code."""
    before = read_cell(folder)
    if before is not None and before["status"] == DONE:
        return EXIT_DONE
    if before is not None and before["status"] == FAILED and not retry:
        return EXIT_FAILED
    import_modules([])
    config = cell.config()
    if before is not None and (different := differences(before["config"], config)):
        print(f"another configuration: {'; '.join(different)}", file=sys.stderr)
        return EXIT_REFUSED
    remove_partial_files(folder)
    pin_threads()
    content = describe(cell, config, before)
    write_cell(folder, content)
    return _run_and_record(cell, config, folder, content)


def describe(cell: Cell, config: ResolvedConfig, before: dict[str, Any] | None) -> dict[str, Any]:
    """Return the content of the cell file of a running cell; `before` is what an interrupted run left."""
    started = before["timings"]["started"] if before is not None else _now()
    return {
        "schema": SCHEMA,
        "status": RUNNING,
        **{name: value for name, value in asdict(cell).items() if name not in ("steps", "overrides")},
        "variant": cell.variant,
        LABEL_COLUMN: load_method(cell.method).label,
        "env_steps": before["env_steps"] if before is not None else 0,
        "config": config.as_json(),
        "versions": package_versions(),
        "host": host_facts(config.run.threads),
        "pid": os.getpid(),
        "timings": {"started": started, "ended": None, "train_s": None, "evaluate_s": None, "wall_s": None},
        "failure": None,
    }


def pin_threads() -> None:
    """Pin torch to one thread, where a method has imported it; the other libraries read their environment variables.

    Sums of floats depend on a library's threads. More cores are used side by side instead: see `Method.use_cores`.
    """
    if "torch" in sys.modules:
        sys.modules["torch"].set_num_threads(1)


def failure(message: str, trace: str) -> dict[str, str]:
    """Return what a cell file says of a failure: one line, and the traceback or the end of the output."""
    return {"message": message, "traceback": trace}


def end(folder: Path, content: dict[str, Any], status: str, **changes: Any) -> None:
    """Write the cell file of a cell that has ended."""
    timings = {**content["timings"], **changes.pop("timings", {}), "ended": _now()}
    write_cell(folder, {**content, **changes, "status": status, "timings": timings})


def _run_and_record(cell: Cell, config: ResolvedConfig, folder: Path, content: dict[str, Any]) -> int:
    run: CellRun | None = None
    try:
        run = CellRun(cell, config, folder)
        finished = run.finish()
    except Exception as error:
        message = str(error) if isinstance(error, UserError) else traceback.format_exception_only(error)[-1].strip()
        reached = {} if run is None else {"env_steps": run.progress.env_steps, "timings": run.timings()}
        end(folder, content, FAILED, failure=failure(message, traceback.format_exc()), **reached)
        return EXIT_FAILED
    end(folder, content, DONE, env_steps=finished.env_steps, timings=finished.timings)
    remove_checkpoint(folder / CHECKPOINT_FILE)
    for name in (PROGRESS_FILE, LOG_FILE, LOCK_FILE):
        (folder / name).unlink(missing_ok=True)
    return EXIT_DONE


def _now() -> str:
    return datetime.now(timezone.utc).isoformat(timespec="seconds")


def _end_with_parent() -> None:
    """End this process at once when its standard input closes, which the system does when the parent dies."""

    def wait() -> None:
        while os.read(0, 4096):
            pass
        os._exit(EXIT_ORPHANED)

    threading.Thread(target=wait, daemon=True).start()


def start() -> None:
    """Run `main` as a process of its own."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent decides
    faulthandler.enable()
    _end_with_parent()
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)  # nothing is left to clean up, and a library's exit handler could hang


if __name__ == "__main__":
    start()
