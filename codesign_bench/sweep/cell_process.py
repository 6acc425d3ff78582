"""The process of one cell: it holds the cell's lock, runs the cell, records the outcome, and ends when its parent dies.

Started by `codesign_bench.sweep.workers`, with the number of threads of numerical libraries set in its environment.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
import traceback
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import filelock

from codesign_bench.cell.cell import Cell, ResolvedCell, resolve_cell
from codesign_bench.code_version import code_version
from codesign_bench.errors import UserError
from codesign_bench.machine import host_facts, package_versions
from codesign_bench.plugins import import_modules
from codesign_bench.processes import pin_threads, watched_by_parent
from codesign_bench.storage.cells import table_checksums
from codesign_bench.storage.checkpoint import remove_checkpoint
from codesign_bench.storage.files import remove_partial_files
from codesign_bench.storage.layout import CHECKPOINT_FILE, remove_leftovers
from codesign_bench.storage.locks import locked
from codesign_bench.storage.provenance import same_conditions
from codesign_bench.storage.records import DONE, FAILED, CellRecord, Failure, Timings, now
from codesign_bench.storage.system_errors import momentary_cause
from codesign_bench.sweep.stale import changed_members, other_packages, own_code
from codesign_bench.sweep.training import CellRun

EXIT_DONE, EXIT_FAILED, EXIT_REFUSED, EXIT_BUSY = 0, 1, 2, 75
EXIT_SYSTEM_ERROR = 100
"""Plus the number of an error of the system. An exit code tells the reason even where nothing can be written."""
LOCK_SECONDS = 2.0
"""Longer than `status` holds the lock to check it."""


def main(arguments: list[str] | None = None) -> int:
    """Run a cell, given as JSON by the first argument, in the results folder of the second argument.

    With `retry` among further arguments, a failed cell runs again; with `same-code`, a cell that was begun with other
    code of its task or method resumes. Returns one of the exit codes above.
    """
    cell_json, out, *options = sys.argv[1:] if arguments is None else arguments
    cell = Cell.from_json(cell_json)
    folder = cell.folder(Path(out))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with locked(folder, LOCK_SECONDS):
            return run_locked(cell, folder, retry="retry" in options, same_code="same-code" in options)
    except filelock.Timeout:
        return EXIT_BUSY
    except Exception as error:
        number = momentary_cause(error) or getattr(error, "errno", None)
        if number is None and not isinstance(error, UserError):
            raise
        with suppress(OSError):
            print(error, file=sys.stderr) if number is None else traceback.print_exc()
        return EXIT_REFUSED if number is None else EXIT_SYSTEM_ERROR + number


def run_locked(cell: Cell, folder: Path, *, retry: bool, same_code: bool = False) -> int:
    """Run `cell` while holding its lock, unless another process has finished it; return the exit code."""
    before = CellRecord.read(folder)
    if before is not None and before.status == DONE:
        return EXIT_DONE
    if before is not None and before.status == FAILED and not retry:
        return EXIT_FAILED
    import_modules([])
    resolved = resolve_cell(cell)
    if before is not None and (different := resolved.differences(before.config, before.task_version)):
        print(f"the stored configuration differs: {'; '.join(different)}", file=sys.stderr)
        return EXIT_REFUSED
    if before is not None and not same_code and (changed := changed_members(resolved, before)):
        if before.status != FAILED:
            print(f"it was begun with other code of {' and '.join(changed)}", file=sys.stderr)
            return EXIT_REFUSED
        remove_checkpoint(folder / CHECKPOINT_FILE)  # a failed cell that is mended starts anew
        before = None
    remove_partial_files(folder)
    pin_threads()  # methods use more cores in another way: see `Method.use_cores`
    record = describe(resolved, before)
    record.write(folder)
    return _run_and_record(resolved, folder, record)


def describe(resolved: ResolvedCell, before: CellRecord | None) -> CellRecord:
    """Return the record of a running cell; `before` is the record of an interrupted run, if any."""
    cell, config = resolved.cell, resolved.config
    record = CellRecord(
        task=cell.task,
        task_version=resolved.task.version,
        method=cell.method,
        variant=cell.variant,
        seed=cell.seed,
        profile=cell.profile,
        label=resolved.method_class.label_of(config.method),
        env_steps=0 if before is None else before.env_steps,
        config=config.stored(),
        versions=package_versions(),
        code=code_version().to_json(),
        packages=other_packages(resolved),
        members=own_code(resolved),
        host=host_facts(config.run.threads),
        pid=os.getpid(),
        timings=Timings(started=now() if before is None else before.timings.started),
    )
    return record if before is None else replace(record, earlier=_earlier(before, record))


def _earlier(before: CellRecord, record: CellRecord) -> tuple[Mapping[str, Any], ...]:
    """Return the conditions of the parts of an interrupted run that differ from those under which it is resumed."""
    parts = (*before.earlier, before.conditions)
    return tuple(part for part in parts if not same_conditions(part, record.conditions))


def _run_and_record(resolved: ResolvedCell, folder: Path, record: CellRecord) -> int:
    run: CellRun | None = None
    try:
        run = CellRun(resolved, folder)
        run.finish()
    except Exception as error:
        if momentary_cause(error) is not None:
            raise  # The record says that the cell is running; without its lock this means that it was interrupted.
        message = str(error) if isinstance(error, UserError) else traceback.format_exception_only(error)[-1].strip()
        reached = {} if run is None else {"env_steps": run.progress.env_steps, "timings": run.timings()}
        record.ended(FAILED, failure=Failure(message, traceback.format_exc()), **reached).write(folder)
        return EXIT_FAILED
    reached = {"env_steps": run.progress.env_steps, "timings": run.timings()}
    record.ended(DONE, checksums=table_checksums(folder), **reached).write(folder)
    with suppress(OSError):  # the cell is done; the next sweep tries again
        remove_leftovers(folder)
    return EXIT_DONE


def start() -> None:
    """Run `main` as a separate process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole process group; the parent handles it
    faulthandler.enable()
    watched_by_parent()
    code = main()
    with suppress(OSError, ValueError):  # the log is on a full disk, or closed
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(code)  # nothing is left to clean up, and a library's exit handler could hang


if __name__ == "__main__":
    start()
