"""The lock of a running cell, which the process that runs it holds.

It is a lock of the operating system, which ends with its process. Some network file systems have none. There a cell is
guarded by a file that names its holder's process and host; if that process is gone, another one on the same host takes
the lock over, and on another host the file has to be removed by hand.
"""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import filelock

LOCK_FILE = "cell.lock"
HOLDER_FILE = "cell.lock.holder"
"""Guards the cell where the file system has no locks."""
PROBE_FILE = ".codesign-bench.json-lock.partial"
"""Shows whether there are locks. Named like an unfinished marker file, which the next sweep removes."""
WITHOUT_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
"""How file systems without locks answer."""


@contextmanager
def locked(folder: Path, timeout: float = 0.0) -> Iterator[None]:
    """Hold the lock of the cell in `folder`; wait up to `timeout` seconds for it.

    Raises:
        filelock.Timeout: another process holds it.
        OSError: the lock file cannot be made.
    """
    try:
        lock = _of_the_system(folder / LOCK_FILE, timeout)
    except OSError as error:
        if error.errno not in WITHOUT_LOCKS:
            raise
        lock = filelock.SoftFileLock(folder / HOLDER_FILE)
        # The first try may do no more than remove the file of a process that is gone.
        lock.acquire(timeout=max(timeout, 0.1), poll_interval=0.02)
    try:
        yield
    finally:
        with suppress(OSError):  # what happened under the lock matters more; the lock ends with its process
            lock.release()


def _of_the_system(path: Path, timeout: float) -> filelock.BaseFileLock:
    """Return a lock of the operating system, which this process holds from now on.

    Raises:
        filelock.Timeout: another process holds it.
        OSError: the file system has no locks, or the file cannot be made.
    """
    # Without locks, the library would change to a lock of another kind on the same file, for one of the errors.
    lock = filelock.FileLock(path, fallback_to_soft=False)
    lock.acquire(timeout=timeout)
    return lock


def is_locked(folder: Path) -> bool:
    """Return whether a process is running the cell in `folder`; no in a folder that cannot be read or written."""
    try:
        if not any((folder / name).exists() for name in (LOCK_FILE, HOLDER_FILE)):
            return False
        with locked(folder):
            return False
    except filelock.Timeout:
        return True
    except OSError:
        return False


def has_locks(folder: Path) -> bool:
    """Return whether the file system of `folder` has locks; yes where no file can be made to find out."""
    probe = folder / PROBE_FILE
    try:
        _of_the_system(probe, timeout=1.0).release()
        return True
    except OSError as error:  # also the timeout: another process is finding out, so there are locks
        return error.errno not in WITHOUT_LOCKS
    finally:
        with suppress(OSError):
            probe.unlink(missing_ok=True)
