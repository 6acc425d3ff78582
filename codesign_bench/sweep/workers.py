"""The work of a joblib worker: run one cell in a new process and return its outcome."""

from __future__ import annotations

import os
import signal
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import filelock

from codesign_bench.cell.cell import Cell
from codesign_bench.errors import UserError
from codesign_bench.processes import end_with, python_process, thread_environment
from codesign_bench.startup import IMPORTS_VARIABLE
from codesign_bench.storage.layout import LOG_FILE, PROGRESS_FILE
from codesign_bench.storage.locks import is_locked, locked
from codesign_bench.storage.records import DONE, FAILED, INTERRUPTED, RUNNING, CellRecord, Failure
from codesign_bench.storage.system_errors import in_words, is_momentary, momentary_cause
from codesign_bench.sweep import cell_process

BUSY = "busy"
"""The outcome of a cell that another sweep is running."""
SETTLE_SECONDS = 1.0
STOPPING = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
"""Signals by which people and clusters stop a process."""


@dataclass(frozen=True)
class Job:
    """One cell and how to run it, as plain values that can be sent to a worker."""

    cell: Cell
    out: str
    retry_failed: bool
    imported: str
    """Modules of `--import`, as in the environment variable, which a worker on another machine does not have."""
    same_code: bool = False
    """Whether a cell that was begun with other code of its task or method resumes."""


@dataclass(frozen=True)
class Outcome:
    """How one cell ended: "done", "failed", "interrupted" or "busy"."""

    cell: Cell
    status: str
    message: str = ""
    """The error in one line."""


def prepare_worker(main_pid: int) -> None:
    """Make this joblib worker ignore Ctrl-C, which the main process handles, and end with the main process."""
    if os.getpid() == main_pid:
        return
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with(main_pid)


def run_job(job: Job) -> Outcome:
    """Run the job's cell in a separate process and return its outcome; a dead process is recorded as a failure.

    What the system refuses in the cell's folder is the outcome of this cell, so that other cells go on.
    """
    folder = job.cell.folder(Path(job.out))
    try:
        return _run(job, folder)
    except (UserError, OSError) as error:
        status = FAILED if momentary_cause(error) is None else INTERRUPTED
        return Outcome(job.cell, status, in_words(error) if isinstance(error, OSError) else str(error))


def _run(job: Job, folder: Path) -> Outcome:
    folder.mkdir(parents=True, exist_ok=True)
    if is_locked(folder):
        return Outcome(job.cell, BUSY)
    for name in (PROGRESS_FILE, LOG_FILE):  # opening a pipe in their place would wait for a reader
        with suppress(OSError):  # nothing depends on them
            (folder / name).unlink(missing_ok=True)
    code = _run_process(job, folder)
    if code == cell_process.EXIT_DONE:
        return Outcome(job.cell, DONE)
    if code == cell_process.EXIT_BUSY:
        return Outcome(job.cell, BUSY)
    if code == cell_process.EXIT_FAILED and (message := _recorded_failure(folder)):
        return Outcome(job.cell, FAILED, message)
    if code == cell_process.EXIT_REFUSED:
        return Outcome(job.cell, FAILED, _end_of_log(folder).strip())
    if code > cell_process.EXIT_SYSTEM_ERROR:
        number = code - cell_process.EXIT_SYSTEM_ERROR
        return Outcome(job.cell, INTERRUPTED if is_momentary(number) else FAILED, f"{os.strerror(number)}: {folder}")
    if -code in STOPPING:  # whoever asked it to stop did not say that the cell is bad
        return Outcome(job.cell, INTERRUPTED, describe_exit(code))
    return Outcome(job.cell, FAILED, _record_death(folder, code))


def _open_log(folder: Path) -> BinaryIO:
    """Return the log of a cell's process, or nothing's where it cannot be written: no result depends on it."""
    try:
        return open(folder / LOG_FILE, "wb")
    except OSError:
        return open(os.devnull, "wb")


def _run_process(job: Job, folder: Path) -> int:
    flags = [name for name, chosen in (("retry", job.retry_failed), ("same-code", job.same_code)) if chosen]
    environment = {**thread_environment(), IMPORTS_VARIABLE: job.imported}
    with _open_log(folder) as log:
        process = python_process(
            cell_process.__name__, job.cell.to_json(), job.out, *flags, stdout=log, stderr=log, env=environment
        )
        try:
            return process.wait()
        finally:
            if process.poll() is None:
                process.kill()
                process.wait()


def _recorded_failure(folder: Path) -> str:
    record = CellRecord.read(folder)
    return record.failure.message if record is not None and record.failure is not None else ""


def _record_death(folder: Path, code: int) -> str:
    """Record that a cell's process died and return the message; called when no other process runs the cell."""
    # If the whole process tree is being killed, this process also dies now: then the cell is interrupted, not failed.
    time.sleep(SETTLE_SECONDS)
    message = describe_exit(code)
    try:
        with locked(folder):
            record = CellRecord.read(folder)
            if record is not None and record.status == RUNNING:
                trace = _end_of_log(folder) or message
                record.ended(FAILED, failure=Failure(message, trace)).write(folder)
            elif record is None:
                # Nothing could be recorded: the line shows what went wrong, the file what led to it.
                last = _end_of_log(folder).strip().rpartition("\n")[2].strip()
                message = f"{message}: {last} (all in {folder / LOG_FILE})" if last else message
    except (filelock.Timeout, UserError) as error:
        return f"{message} ({error})"
    except OSError as error:
        return f"{message} (not recorded: {in_words(error)})"
    return message


def describe_exit(code: int) -> str:
    """Describe in words how a process ended that recorded no outcome."""
    if code >= 0:
        return f"the cell's process ended with exit code {code} and recorded nothing"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = f"signal {-code}"
    hint = "; the system may be out of memory" if name == "SIGKILL" else ""
    return f"the cell's process was killed by {name}{hint}"


def _end_of_log(folder: Path, characters: int = 4000) -> str:
    try:
        return (folder / LOG_FILE).read_text(errors="replace")[-characters:]
    except OSError:
        return ""
