"""Write files atomically: a kill at any moment leaves the old file or the new one."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

PARTIAL = ".partial"
"""How names of unfinished files end."""


@contextmanager
def replacing(path: Path, *, durable: bool = True) -> Iterator[BinaryIO]:
    """Give a stream whose content replaces `path` atomically when the `with` block ends without an error.

    `durable` waits until the content is on disk.
    """
    descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}-", suffix=PARTIAL)
    try:
        with os.fdopen(descriptor, "wb") as stream:
            yield stream
            stream.flush()
            if durable:
                os.fsync(stream.fileno())
        os.chmod(temporary, 0o644)  # mkstemp makes files that only their owner may read
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def write_bytes(path: Path, content: bytes, *, durable: bool = True) -> None:
    """Replace `path` by `content` atomically; `durable` waits until it is on disk."""
    with replacing(path, durable=durable) as stream:
        stream.write(content)


def write_json(path: Path, values: Any, *, durable: bool = True) -> None:
    """Replace `path` by `values` as indented JSON; numpy numbers become Python numbers."""
    write_bytes(path, (dump_json(values, indent=2) + "\n").encode(), durable=durable)


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


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is not a JSON value")
