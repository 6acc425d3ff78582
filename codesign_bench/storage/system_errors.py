"""Errors of the operating system while a cell runs: which of them may be gone when the same command is repeated.

A full disk, a quota or a device that does not answer says nothing about the cell, which can resume. A folder that
belongs to somebody else, or a file in its place, stays as it is until the user does something.
"""

from __future__ import annotations

import errno
import os

from codesign_bench.storage.files import reason_of

MOMENTARY = frozenset(
    getattr(errno, name)
    for name in (
        *("ENOSPC", "EDQUOT", "EFBIG", "EIO", "ENXIO", "ENODEV", "EROFS", "EBUSY", "ETXTBSY"),
        *("ESTALE", "EREMOTEIO", "ENOLCK", "ETIMEDOUT", "ECONNRESET", "ECONNREFUSED", "EHOSTDOWN", "EHOSTUNREACH"),
        *("ENETDOWN", "ENETUNREACH", "ENOTCONN", "ESHUTDOWN", "EPIPE", "EPROTO", "ECOMM"),
        *("EMFILE", "ENFILE", "ENOMEM", "ENOBUFS", "EAGAIN", "EINTR"),
    )
    if hasattr(errno, name)
)
"""Numbers of errors after which the same command may succeed: storage, network, and resources of the system."""


def is_momentary(number: int | None) -> bool:
    """Return whether the same command may succeed after the error with this number."""
    return number in MOMENTARY


def momentary_cause(error: BaseException) -> int | None:
    """Return the number of the momentary error of the system that is, or led to, `error`; None if there is none."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, OSError) and is_momentary(cause.errno):
            return cause.errno
        cause = cause.__cause__
    return None


def in_words(error: OSError) -> str:
    """Return an error and its file in one line."""
    where = error.filename
    return f"{reason_of(error)}: {os.fsdecode(where)}" if isinstance(where, (str, bytes)) else reason_of(error)
