"""Arrays with a JSON header in one file, in the form of safetensors with a checksum: policies and checkpoints."""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load, save

from codesign_bench.method import Array
from codesign_bench.storage.files import dump_json, reason_of, write_bytes
from codesign_bench.storage.json_fields import whole
from codesign_bench.storage.reading import MEGABYTE, DamagedFile, UnreadableFile, open_regular, parse_json

HEADER = "codesign_bench"
"""Key of the JSON header in the file's metadata."""
PIECE = 2**20
"""Bytes per read when a file is only checked."""
ARRAYS_BYTES = 256 * MEGABYTE
"""Largest file of arrays that is read whole; a policy of the paper's size has less than one megabyte."""
HEADER_BYTES = 32 * MEGABYTE
"""Largest header: that of a checkpoint has the cell's curve and metrics."""
DAMAGED_HEADER = (ValueError, KeyError, TypeError, AttributeError, IndexError, OverflowError)
"""The exceptions of reading a damaged header."""


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
        UnusableFile: it is no regular file, too large, or the system did not let us read it.
    """
    with open_stream(path, ARRAYS_BYTES) as stream:
        header = checked_header(stream)
        stream.seek(0)
        try:
            return load(stream.read()), header
        except (SafetensorError, KeyError, TypeError) as error:  # a type of numbers that numpy does not have
            raise ValueError("damaged or not written by codesign-bench") from error


def check_arrays(path: Path) -> None:
    """Check header and checksum of a file that `save_arrays` wrote, without loading it whole.

    Raises:
        UnusableFile: it is damaged, or the system did not let us read it.
    """
    try:
        with open_stream(path, ARRAYS_BYTES) as stream:
            checked_header(stream)
    except ValueError as error:
        raise DamagedFile(path, str(error)) from error
    except OSError as error:
        raise UnreadableFile(path, reason_of(error)) from error


def open_stream(path: Path, limit: int) -> BinaryIO:
    """Return a stream of a regular file.

    Raises:
        FileNotFoundError: it does not exist.
        UnusableFile: it is no regular file, too large, or cannot be opened.
    """
    return os.fdopen(open_regular(path, limit), "rb")


def checked_header(stream: BinaryIO) -> dict[str, Any]:
    """Return the header that `save_arrays` wrote, after checking every byte of the arrays.

    Raises:
        ValueError: the file is damaged or of another kind.
    """
    try:
        size = int.from_bytes(stream.read(8), "little")
        if size > min(HEADER_BYTES, os.fstat(stream.fileno()).st_size):
            raise ValueError("its header is longer than the file")
        layout = parse_json(stream.read(size))
        header: dict[str, Any] = parse_json(layout.pop("__metadata__")[HEADER])
        offsets = {
            name: [8 + size + whole({name: end}, name) for end in layout[name]["data_offsets"]]
            for name in sorted(layout)
        }
        expected = header.pop("checksum")
        found = _checksum((name, _pieces(stream, *ends)) for name, ends in offsets.items())
    except DAMAGED_HEADER as error:
        raise ValueError("damaged or not written by codesign-bench") from error
    if os.fstat(stream.fileno()).st_size != max((end for _, end in offsets.values()), default=8 + size):
        raise ValueError("damaged: something is missing or added at its end")
    if expected != found:
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
