"""Write files atomically: a kill at any moment, or a failed write, leaves the old file or the new one.

A set of files that belong together, such as a figure's, is replaced as a whole: `Outputs` writes all of them beside
their places first and moves them there when the last is complete.
"""

from __future__ import annotations

import json
import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

import numpy as np

from codesign_bench.errors import UserError

PARTIAL = ".partial"
"""Ending of a file that is not complete yet; its name begins with a dot."""
NAME_SHOWN = 100
"""Characters of a file's name in the name of its partial file, which must not be too long either."""


@contextmanager
def replacing(path: Path, *, durable: bool = True) -> Iterator[BinaryIO]:
    """Give a stream whose content replaces `path` atomically when the `with` block ends without an error.

    `durable` waits until the content is on disk.
    """
    temporary = _beside(path)
    try:
        with _created(temporary) as stream:
            yield stream
            stream.flush()
            if durable:
                os.fsync(stream.fileno())
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def write_bytes(path: Path, content: bytes, *, durable: bool = True) -> None:
    """Replace `path` by `content` atomically; `durable` waits until it is on disk."""
    with replacing(path, durable=durable) as stream:
        stream.write(content)


def write_json(path: Path, values: Any, *, durable: bool = True) -> None:
    """Replace `path` by `values` as indented JSON; numpy numbers become Python numbers."""
    write_bytes(path, json_bytes(values), durable=durable)


class Outputs:
    """Files that belong together; a context manager that puts all of them in place at its end, or none after an error.

    Folders are made as needed.

    Raises:
        UserError: a file cannot be written; the message names it and the system's reason.
    """

    def __init__(self, what: str) -> None:
        self._what = what
        """The option or the purpose that errors name first, e.g. `--out DIR`."""
        self._partial: dict[Path, Path] = {}

    def __enter__(self) -> Outputs:
        return self

    def write(self, path: Path, content: bytes | str) -> None:
        """Write the later content of `path` to a partial file beside it; text becomes UTF-8."""
        with saying_why(self._what, path):
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.is_dir():
                raise IsADirectoryError(None, "it is a folder")
            temporary = _beside(path)
            self._partial[path] = temporary
            with _created(temporary) as stream:
                stream.write(encoded(content) if isinstance(content, str) else content)
                stream.flush()
                os.fsync(stream.fileno())

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            for path, temporary in self._partial.items() if error is None else ():
                with saying_why(self._what, path):
                    os.replace(temporary, path)
        finally:
            for temporary in self._partial.values():
                temporary.unlink(missing_ok=True)


def write_output(what: str, path: Path, content: bytes | str) -> None:
    """Replace one file that a user asked for; `what` names the option.

    Raises:
        UserError: it cannot be written; the message has the system's reason.
    """
    with Outputs(what) as outputs:
        outputs.write(path, content)


def make_folder(what: str, folder: Path) -> None:
    """Make a folder and check that files can be written into it; `what` names the option.

    Raises:
        UserError: they cannot; the message has the system's reason.
    """
    probe = _beside(folder / "probe")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _created(probe).close()
        probe.unlink(missing_ok=True)
    except OSError as error:
        raise UserError(f"{what}: not writable ({reason_of(error)})") from error


@contextmanager
def removed_if_refused(out: Path) -> Iterator[None]:
    """Remove the folder `out` and those above it if they are new and empty when the `with` block ends with an error."""
    new = [folder for folder in (out, *out.parents) if not folder.exists()]
    try:
        yield
    except BaseException:
        with suppress(OSError):  # one that is not empty stays, and those above it with it
            for folder in new:
                folder.rmdir()
        raise


@contextmanager
def saying_why(what: str, path: Path) -> Iterator[None]:
    """Turn a failure of the system into one line.

    Raises:
        UserError: names `what`, the path, and the system's reason.
    """
    try:
        yield
    except OSError as error:
        raise UserError(f"{what}: {path.name} is not writable ({reason_of(error)})") from error


def reason_of(error: OSError) -> str:
    """Return the system's reason in words, e.g. "No space left on device"."""
    return error.strerror or " ".join(str(error).split()) or type(error).__name__


def encoded(text: str) -> bytes:
    """Return text as UTF-8; parts of paths that are no text, which Python keeps as surrogates, become escapes."""
    return text.encode("utf-8", "backslashreplace")


def json_bytes(values: Any) -> bytes:
    """Return `values` as the content of a file of indented JSON."""
    return (dump_json(values, indent=2) + "\n").encode()


def dump_json(values: Any, indent: int | None = None) -> str:
    """Return `values` as JSON; numpy numbers and arrays become Python ones, and floats are restored exactly."""
    return json.dumps(values, indent=indent, default=_plain)


def partial_pattern(name: str = "") -> str:
    """Return the pattern of the unfinished files that `replacing` makes: all of them, or those that become `name`."""
    return f".{name}-*{PARTIAL}" if name else f".*{PARTIAL}"


def is_partial(name: str) -> bool:
    """Return whether an unfinished file of `replacing` may have this name."""
    return name.startswith(".") and name.endswith(PARTIAL)


def remove_partial_files(folder: Path) -> None:
    """Remove unfinished files that a killed process left in `folder`; call it only while holding its lock."""
    for leftover in folder.glob(partial_pattern()):
        leftover.unlink(missing_ok=True)


def _beside(path: Path) -> Path:
    """Return an unused name in the same folder."""
    return path.with_name(f".{path.name[:NAME_SHOWN]}-{uuid.uuid4().hex}{PARTIAL}")


def _created(path: Path) -> BinaryIO:
    """Return a new file, with the permissions that the user's umask leaves."""
    return os.fdopen(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_CLOEXEC, 0o666), "wb")


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is not a JSON value")
