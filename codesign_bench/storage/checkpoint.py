"""Checkpoints: everything an interrupted cell needs to resume bit for bit, without pickle.

A checkpoint is one file, `checkpoint.safetensors`, or two: the large arrays of a method (`State.large`) are in a second
file, `checkpoint.large-<generation>.npz`. They are streamed array by array, so that memory never holds a second copy.

The pair is consistent whenever a process is killed. The large file is written first, under a new name; then the small
file, which has the large file's name and checksums, is replaced atomically; then older large files are removed. So the
small file on disk always names a complete large file that was saved with it.
"""

from __future__ import annotations

import math
import zipfile
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np

from codesign_bench.errors import UserError
from codesign_bench.method import Array, State
from codesign_bench.storage.arrays import (
    ARRAYS_BYTES,
    DAMAGED_HEADER,
    PIECE,
    checked_header,
    load_arrays,
    open_stream,
    save_arrays,
)
from codesign_bench.storage.files import reason_of, replacing
from codesign_bench.storage.reading import MEGABYTE, UnusableFile

LARGE_BYTES = 64 * 1024 * MEGABYTE
"""Largest file of large arrays, which is read array by array."""
DAMAGED_ZIP = (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, ValueError, zlib.error)
"""The exceptions of reading a damaged `.npz` file."""
RESTART = "delete it to restart the cell"
"""Said only of a checkpoint whose content was read and is damaged."""


@dataclass
class Progress:
    """The progress of a cell, including the rows of its curve, so that curve and learner always agree."""

    env_steps: int = 0
    gradient_steps: int = 0
    next_mark: int = 0
    """Index of the next evaluation."""
    curve: list[dict[str, Any]] = field(default_factory=list)
    metrics: list[dict[str, Any]] = field(default_factory=list)
    pending_metrics: dict[str, list[float]] = field(default_factory=dict)
    """Sum and count of each metric since the last evaluation."""
    train_s: float = 0.0
    evaluate_s: float = 0.0
    wall_s: float = 0.0
    """Seconds since the cell's start, without the time between interruption and resumption."""


@dataclass(frozen=True)
class Checkpoint:
    """A cell in the middle of its training."""

    state: State
    streams: dict[str, Any]
    progress: Progress


def save_checkpoint(path: Path, checkpoint: Checkpoint) -> None:
    """Replace the checkpoint in `path` and its large file."""
    large, checksums = None, None
    if checkpoint.state.large:
        large = path.with_name(f"{path.stem}.large-{1 + max(map(_generation, _large_files(path)), default=0)}.npz")
        checksums = _save_large(large, checkpoint.state.large)
    header = {
        "values": checkpoint.state.values,
        "streams": checkpoint.streams,
        "progress": vars(checkpoint.progress),
        "large": None if large is None else {"file": large.name, "checksums": checksums},
    }
    save_arrays(path, checkpoint.state.arrays, header)
    for other in _large_files(path):
        if other != large:
            other.unlink(missing_ok=True)


def load_checkpoint(path: Path) -> Checkpoint | None:
    """Return the checkpoint in `path`, or None if there is none.

    Raises:
        UserError: it is truncated or damaged.
    """
    return _usable(path, _load_checkpoint)


def check_checkpoint(path: Path) -> int:
    """Check header and checksums of the checkpoint in `path` without loading it whole.

    Returns:
        Its environment steps; 0 if there is no checkpoint.

    Raises:
        UserError: it is truncated or damaged.
    """
    return _usable(path, _check_checkpoint) or 0


def remove_checkpoint(path: Path) -> None:
    """Remove the checkpoint in `path` and its large files."""
    path.unlink(missing_ok=True)
    for large in _large_files(path):
        large.unlink(missing_ok=True)


def _load_checkpoint(path: Path) -> Checkpoint:
    arrays, header = load_arrays(path)
    large = _read_large(path, header, _load_member)
    return Checkpoint(State(arrays, header["values"], large), header["streams"], Progress(**header["progress"]))


def _check_checkpoint(path: Path) -> int:
    with open_stream(path, ARRAYS_BYTES) as stream:
        header = checked_header(stream)
    progress = Progress(**header["progress"])
    _read_large(path, header, _check_member)
    return progress.env_steps


def _usable(path: Path, read: Callable[[Path], Any]) -> Any:
    """Return the result of `read(path)`, or None if the file does not exist.

    Raises:
        UserError: it is truncated or damaged, or the system did not let us read it.
    """
    try:
        return read(path)
    except FileNotFoundError as error:
        if Path(error.filename) == path:
            return None
        raise UserError(f"checkpoint {path} is unusable (no {Path(error.filename).name}); {RESTART}") from error
    except UnusableFile as error:
        raise UserError(f"checkpoint {error.path} is unusable ({error.reason})") from error
    except OSError as error:
        raise UserError(f"cannot read checkpoint {path} ({reason_of(error)})") from error
    except DAMAGED_HEADER as error:
        raise UserError(f"checkpoint {path} is unusable ({error}); {RESTART}") from error


def _large_files(path: Path) -> list[Path]:
    """Return all large files next to the checkpoint `path`, including those that it does not name."""
    found = path.parent.glob(f"{path.stem}.large-*.npz")
    return [large for large in found if large.stem.rpartition("-")[2].isdigit()]


def _generation(large: Path) -> int:
    return int(large.stem.rpartition("-")[2])


def _save_large(path: Path, arrays: Mapping[str, Array]) -> dict[str, int]:
    """Replace `path` by arrays, which numpy writes in pieces; return their checksums by name."""
    with replacing(path) as stream, zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asarray(array), allow_pickle=False)
        return _checksums(archive)


def _checksums(archive: zipfile.ZipFile) -> dict[str, int]:
    return {info.filename.removesuffix(".npy"): info.CRC for info in archive.infolist()}


def _read_large(
    path: Path, header: Mapping[str, Any], read: Callable[[zipfile.ZipFile, zipfile.ZipInfo], Any]
) -> dict[str, Any]:
    """Return name -> `read(array)` for each large array of the checkpoint in `path` with this header.

    Raises:
        OSError: the file does not exist.
        ValueError: it is damaged, or not the one that the header names.
    """
    if header.get("large") is None:
        return {}
    large, found = path.with_name(Path(header["large"]["file"]).name), {}
    try:
        with open_stream(large, LARGE_BYTES) as stream, zipfile.ZipFile(stream) as archive:
            if _checksums(archive) != header["large"]["checksums"]:
                raise ValueError("its checksums are not those of the checkpoint")
            for info in archive.infolist():
                if info.compress_type != zipfile.ZIP_STORED or info.compress_size != info.file_size:
                    raise ValueError("it is compressed")  # we never do; a small file could fill the memory
                found[info.filename.removesuffix(".npy")] = read(archive, info)
    except DAMAGED_ZIP as error:
        raise ValueError(f"{large.name} is damaged: {error}") from error
    return found


def _load_member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> Array:
    with archive.open(info) as member:
        _check_shape(cast(BinaryIO, member), info.file_size)
    with archive.open(info) as member:  # compares the checksum after the last byte
        array: Array = np.lib.format.read_array(cast(BinaryIO, member), allow_pickle=False)
        if member.read(1):
            raise ValueError("longer than its array")
    return array


def _check_shape(member: BinaryIO, size: int) -> None:
    """Check that an array's header asks for as many bytes as there are, before they are allocated.

    Raises:
        ValueError: it does not.
    """
    versions = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
    version = np.lib.format.read_magic(member)
    if version not in versions:
        raise ValueError(f"its version {version} is unknown")
    shape, _, kind = versions[version](member)
    if kind.hasobject or member.tell() + math.prod(shape) * kind.itemsize != size:
        raise ValueError("its shape is not that of its content")


def _check_member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> None:
    with archive.open(info) as member:
        while member.read(PIECE):
            pass
