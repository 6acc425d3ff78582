"""Write files whole or not at all, so that a kill at any moment leaves the old file or the new one."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np


@contextmanager
def replacing(path: Path, *, durable: bool = True) -> Iterator[BinaryIO]:
    """Give a stream whose content replaces `path` in one step once the `with` block has ended without an error.

    `durable` waits until the disk has it.
    """
    descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}-", suffix=".partial")
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
    """Replace `path` by `content` in one step; `durable` waits until the disk has it."""
    with replacing(path, durable=durable) as stream:
        stream.write(content)


def write_json(path: Path, values: Any, *, durable: bool = True) -> None:
    """Replace `path` by `values` as indented JSON; numpy numbers become plain ones."""
    write_bytes(path, (dump_json(values, indent=2) + "\n").encode(), durable=durable)


def dump_json(values: Any, indent: int | None = None) -> str:
    """Return `values` as JSON; numpy numbers and arrays become plain ones, floats survive the round trip exactly."""
    return json.dumps(values, indent=indent, default=_plain)


def remove_partial_files(folder: Path) -> None:
    """Remove what a killed process left half-written in `folder`; only for the holder of its lock."""
    for leftover in folder.glob(".*.partial"):
        leftover.unlink(missing_ok=True)


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is no JSON value")
