"""Processes of ours: the threads of their numerical libraries, and that none outlives its parent."""

from __future__ import annotations

import os
import threading
import time

THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
"""What the numerical libraries read when they are first imported."""
WATCH_SECONDS = 0.3
EXIT_ORPHANED = 76
"""Exit code of a process whose parent is gone."""


def thread_environment() -> dict[str, str]:
    """Return this process's environment with the numerical libraries pinned to one thread."""
    return {**os.environ, **dict.fromkeys(THREAD_VARIABLES, "1")}


def end_with(parent_pid: int) -> None:
    """End this process soon after its parent ends, however it ends: an orphan would hold a core for nothing."""

    def watch() -> None:
        while os.getppid() == parent_pid:
            time.sleep(WATCH_SECONDS)
        os._exit(EXIT_ORPHANED)

    threading.Thread(target=watch, daemon=True).start()
