"""Child processes: one thread per numerical library, a safe module path, and none that outlives its parent."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from codesign_bench.startup import SAFE_PATH_VARIABLE

THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
"""Environment variables that the numerical libraries read when they are first imported."""
WATCH_SECONDS = 0.3
EXIT_ORPHANED = 76
"""Exit code of a process whose parent has ended."""


def thread_environment() -> dict[str, str]:
    """Return this process's environment with the numerical libraries pinned to one thread, and a safe module path."""
    return {**os.environ, **dict.fromkeys(THREAD_VARIABLES, "1"), SAFE_PATH_VARIABLE: "1"}


@contextmanager
def children_with_safe_modules() -> Iterator[None]:
    """Keep the working folder off the module path of every process that this one starts, directly or by a library."""
    before = os.environ.get(SAFE_PATH_VARIABLE)
    os.environ[SAFE_PATH_VARIABLE] = "1"
    try:
        yield
    finally:
        if before is None:
            os.environ.pop(SAFE_PATH_VARIABLE, None)
        else:
            os.environ[SAFE_PATH_VARIABLE] = before


def existing_folder() -> str | None:
    """Return the folder in which a process can start: the root if the working folder was deleted, else None (here).

    Numerical libraries end a process that has no working folder.
    """
    try:
        os.getcwd()
    except OSError:
        return os.sep
    return None


def end_with(parent_pid: int) -> None:
    """End this process soon after its parent ends for any reason: an orphan would only keep a core busy."""

    def watch() -> None:
        # A process whose parent has ended is adopted by another one, so its parent's id changes.
        while os.getppid() == parent_pid:
            time.sleep(WATCH_SECONDS)
        # sys.exit would end this thread only.
        os._exit(EXIT_ORPHANED)

    threading.Thread(target=watch, daemon=True).start()
