"""Read files of a results folder, whatever is in their place.

A results folder may come from another person, or from a disk that was full. Every file is therefore opened without
waiting, must be a regular file of a stated size, and is parsed strictly. What cannot be used raises one of two errors:
`DamagedFile` if its content was read and is not what belongs there, `UnreadableFile` if the system did not let us read
it. Only the first may be met by deleting anything.
"""

from __future__ import annotations

import json
import os
import stat
from collections import Counter
from pathlib import Path
from typing import Any

from codesign_bench.errors import UserError
from codesign_bench.storage.files import reason_of

MEGABYTE = 2**20
JSON_BYTES = 8 * MEGABYTE
"""Largest JSON file; the largest that a cell writes has tens of kilobytes."""
OPENING = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)


class UnusableFile(UserError):
    """A file of a results folder that cannot be used."""

    def __init__(self, path: Path, reason: str, advice: str = "") -> None:
        super().__init__(f"cannot read {path} ({reason})" + (f"; {advice}" if advice else ""))
        self.path, self.reason = path, reason


class DamagedFile(UnusableFile):
    """The content of a file was read, or its kind seen, and it is not what belongs there."""


class NewerFile(UnusableFile):
    """A file was written by a newer version; it is not damaged."""


class UnreadableFile(UnusableFile):
    """The system did not let us read a file, so nothing is known about its content."""


def is_there(path: Path) -> bool:
    """Return whether there is anything at `path`, also what cannot be read."""
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except OSError:
        return True
    return True


def is_folder(path: Path) -> bool:
    """Return whether `path` is a folder.

    Raises:
        UnreadableFile: the system did not let us look.
    """
    try:
        return path.is_dir()
    except (OSError, ValueError) as error:
        raise UnreadableFile(path, reason_of(error) if isinstance(error, OSError) else str(error)) from error


def open_regular(path: Path, limit: int) -> int:
    """Return a descriptor of the regular file `path` of at most `limit` bytes; nothing is waited for.

    Raises:
        FileNotFoundError: it does not exist.
        UnusableFile: it is no regular file, too large, a link to nothing, or cannot be opened.
    """
    try:
        descriptor = os.open(path, OPENING)
    except FileNotFoundError as error:
        if os.path.islink(path):
            raise UnreadableFile(path, "it is a link to nothing") from error
        raise
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        reason = reason_of(error) if isinstance(error, OSError) else str(error)
        raise UnreadableFile(path, reason) from error
    try:
        _check_kind(path, os.fstat(descriptor), limit)
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def read_bytes(path: Path, limit: int) -> bytes:
    """Return the content of a regular file of at most `limit` bytes.

    Raises:
        FileNotFoundError: it does not exist.
        UnusableFile: it is no regular file, too large, or cannot be read.
    """
    with os.fdopen(open_regular(path, limit), "rb") as stream:
        try:
            content = stream.read(limit + 1)
        except OSError as error:
            raise UnreadableFile(path, reason_of(error)) from error
    if len(content) > limit:  # it has grown since, or its size was not known
        raise DamagedFile(path, _too_large(limit))
    return content


def read_json(path: Path, limit: int = JSON_BYTES) -> Any:
    """Return the values in a JSON file.

    Raises:
        FileNotFoundError: it does not exist.
        UnusableFile: it cannot be read, or is not JSON as we write it: in UTF-8, each key once.
    """
    try:
        return parse_json(read_bytes(path, limit))
    except ValueError as error:
        raise DamagedFile(path, str(error)) from error


def parse_json(content: bytes | str) -> Any:
    """Return the values of JSON in UTF-8 in which each object has each key once.

    Raises:
        ValueError: it is not such JSON.
    """
    try:
        text = content.decode("utf-8") if isinstance(content, bytes) else content
        return json.loads(text, object_pairs_hook=_once, parse_int=_whole)
    except UnicodeDecodeError as error:
        raise ValueError(f"not UTF-8 at byte {error.start}") from error
    except RecursionError as error:
        raise ValueError("nested too deeply") from error


def _check_kind(path: Path, found: os.stat_result, limit: int) -> None:
    if stat.S_ISDIR(found.st_mode):
        raise DamagedFile(path, "it is a folder")
    if not stat.S_ISREG(found.st_mode):
        raise DamagedFile(path, "it is not a regular file")
    if found.st_size > limit:
        raise DamagedFile(path, _too_large(limit))


def _too_large(limit: int) -> str:
    return f"larger than {limit // MEGABYTE} MB"


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    values = dict(pairs)
    if len(values) != len(pairs):
        counts = Counter(name for name, _ in pairs)
        raise ValueError(f"the key {counts.most_common(1)[0][0]!r} is there twice")
    return values


def _whole(text: str) -> int:
    if len(text) > 40:
        raise ValueError(f"a number of {len(text)} digits")
    return int(text)
