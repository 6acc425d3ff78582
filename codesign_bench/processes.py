"""Child processes: one thread per numerical library, a safe module path, and none that outlives its parent."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from codesign_bench.startup import SAFE_PATH_VARIABLE

THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
"""Environment variables that the numerical libraries read when they are first imported."""
START = (
    "import sys; sys.path[:] = filter(None, sys.path); import importlib, json; "
    "sys.path[:] = json.loads(sys.argv.pop(1)); importlib.import_module(sys.argv.pop(1)).start()"
)
"""Starts a module of ours with this process's module path; nothing is imported from the working folder."""
WATCH_SECONDS = 0.3
EXIT_ORPHANED = 76
"""Exit code of a process whose parent has ended."""


def thread_environment() -> dict[str, str]:
    """Return this process's environment with the numerical libraries pinned to one thread, and a safe module path."""
    return {**os.environ, **dict.fromkeys(THREAD_VARIABLES, "1"), SAFE_PATH_VARIABLE: "1"}


def pin_threads() -> None:
    """Pin torch to one thread if it has been imported; other libraries read their environment variables.

    Floating-point sums depend on a library's number of threads.
    """
    if "torch" in sys.modules:
        sys.modules["torch"].set_num_threads(1)


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


def python_process(module: str, *arguments: str, **options: Any) -> subprocess.Popen[Any]:
    """Start `start()` of a module of this package in a new process, with `arguments` in `sys.argv`.

    Its standard input is a pipe that is never written to, and that closes when this process ends: see
    `watched_by_parent`. Its output is a pipe, too, of text, unless `options` of `subprocess.Popen` say where it goes.
    """
    path = [entry for entry in sys.path if entry]  # an empty entry is the working folder
    given = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "env": thread_environment(), **options}
    command = [sys.executable, "-c", START, json.dumps(path), module, *arguments]
    return subprocess.Popen(command, stdin=subprocess.PIPE, cwd=existing_folder(), **given)


def watched_by_parent() -> None:
    """End this process at once when its standard input closes; the system closes it when the parent dies."""

    def wait() -> None:
        while os.read(0, 4096):
            pass
        os._exit(EXIT_ORPHANED)

    threading.Thread(target=wait, daemon=True).start()
