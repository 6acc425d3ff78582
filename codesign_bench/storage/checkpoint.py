"""Checkpoints: everything an interrupted cell needs to resume bit for bit, without pickle.

A checkpoint is one file, `checkpoint.safetensors`, or two: the large arrays of a method (`State.large`) are in a second
file, `checkpoint.large-<generation>.npz`. They are streamed array by array, so that memory never holds a second copy.

The pair is consistent whenever a process is killed. The large file is written first, under a new name; then the small
file, which has the large file's name and checksums, is replaced atomically; then older large files are removed. So the
small file on disk always names a complete large file that was saved with it.
"""

from __future__ import annotations

import json
import os
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load, save

from codesign_bench.errors import UserError
from codesign_bench.method import Array, State
from codesign_bench.storage.files import dump_json, replacing, write_bytes

HEADER = "codesign_bench"
"""Key of the JSON header in the file's metadata."""
PIECE = 2**20
"""Bytes per read when a file is only checked."""
DAMAGED_ZIP = (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, ValueError, zlib.error)
"""The exceptions of reading a damaged `.npz` file."""


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


def save_arrays(path: Path, arrays: Mapping[str, Array], header: Mapping[str, Any]) -> None:
    """Replace `path` by `arrays` and a JSON `header`, with a checksum."""
    ordered = {name: np.asarray(array, order="C") for name, array in arrays.items()}
    text = dump_json({**header, "checksum": _checksum((name, [ordered[name].tobytes()]) for name in sorted(ordered))})
    write_bytes(path, save(ordered, metadata={HEADER: text}))


def load_arrays(path: Path) -> tuple[dict[str, Array], dict[str, Any]]:
    """Return arrays and header that `save_arrays` wrote.

    Raises:
        FileNotFoundError: the file does not exist.
        ValueError: it is damaged or another kind of file.
    """
    header = _checked_header(path)
    try:
        return load(path.read_bytes()), header
    except SafetensorError as error:
        raise ValueError("damaged or not written by codesign-bench") from error


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


def check_checkpoint(path: Path) -> None:
    """Check header and checksums of the checkpoint in `path`, if there is one, without loading it whole.

    Raises:
        UserError: it is truncated or damaged.
    """
    _usable(path, _check_checkpoint)


def remove_checkpoint(path: Path) -> None:
    """Remove the checkpoint in `path` and its large files."""
    path.unlink(missing_ok=True)
    for large in _large_files(path):
        large.unlink(missing_ok=True)


def _load_checkpoint(path: Path) -> Checkpoint:
    arrays, header = load_arrays(path)
    large = _read_large(path, header, _load_member)
    return Checkpoint(State(arrays, header["values"], large), header["streams"], Progress(**header["progress"]))


def _check_checkpoint(path: Path) -> None:
    header = _checked_header(path)
    Progress(**header["progress"])
    _read_large(path, header, _check_member)


def _usable(path: Path, read: Callable[[Path], Any]) -> Any:
    """Return the result of `read(path)`, or None if the file does not exist.

    Raises:
        UserError: it is truncated or damaged.
    """
    if not path.exists():
        return None
    try:
        return read(path)
    except (ValueError, KeyError, TypeError, OSError) as error:
        raise UserError(f"checkpoint {path} is unusable ({error}); delete it to restart the cell") from error


def _checked_header(path: Path) -> dict[str, Any]:
    """Return the header that `save_arrays` wrote, after checking every byte of the arrays.

    Raises:
        FileNotFoundError: the file does not exist.
        ValueError: it is damaged or another kind of file.
    """
    with path.open("rb") as stream:
        try:
            size = int.from_bytes(stream.read(8), "little")
            if size > os.fstat(stream.fileno()).st_size:
                raise ValueError("its header is longer than the file")
            layout = json.loads(stream.read(size))
            header: dict[str, Any] = json.loads(layout.pop("__metadata__")[HEADER])
            offsets = {name: [8 + size + end for end in layout[name]["data_offsets"]] for name in sorted(layout)}
            expected = header.pop("checksum")
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise ValueError("damaged or not written by codesign-bench") from error
        if expected != _checksum((name, _pieces(stream, *ends)) for name, ends in offsets.items()):
            raise ValueError("damaged: its checksum does not match")
    return header


def _pieces(stream: BinaryIO, start: int, end: int) -> Iterator[bytes]:
    """Yield the bytes from `start` to `end` of a file in pieces, fewer if the file is shorter."""
    stream.seek(start)
    while start < end and (piece := stream.read(min(PIECE, end - start))):
        start += len(piece)
        yield piece


def _checksum(contents: Iterator[tuple[str, Any]]) -> int:
    """Return the checksum of arrays, given in alphabetical order as names and pieces of their bytes."""
    total = 0
    for name, pieces in contents:
        total = zlib.crc32(name.encode(), total)
        for piece in pieces:
            total = zlib.crc32(piece, total)
    return total


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


def _read_large(path: Path, header: Mapping[str, Any], read: Callable[[BinaryIO], Any]) -> dict[str, Any]:
    """Return name -> `read(array)` for each large array of the checkpoint in `path` with this header.

    Raises:
        OSError: the file does not exist.
        ValueError: it is damaged, or not the one that the header names.
    """
    if header.get("large") is None:
        return {}
    large, found = path.with_name(header["large"]["file"]), {}
    try:
        with zipfile.ZipFile(large) as archive:
            if _checksums(archive) != header["large"]["checksums"]:
                raise ValueError("its checksums are not those of the checkpoint")
            for info in archive.infolist():
                with archive.open(info) as member:  # compares the checksum after the last byte
                    found[info.filename.removesuffix(".npy")] = read(cast(BinaryIO, member))
    except DAMAGED_ZIP as error:
        raise ValueError(f"{large.name} is damaged: {error}") from error
    return found


def _load_member(member: BinaryIO) -> Array:
    array: Array = np.lib.format.read_array(member, allow_pickle=False)
    if member.read(1):
        raise ValueError("longer than its array")
    return array


def _check_member(member: BinaryIO) -> None:
    while member.read(PIECE):
        pass
