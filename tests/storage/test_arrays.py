"""Arrays in a file: restored to the bit, or refused before anything large is allocated."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from codesign_bench.storage.arrays import check_arrays, load_arrays, save_arrays
from codesign_bench.storage.reading import DamagedFile, UnreadableFile, UnusableFile

ARRAYS = {"weights": np.arange(6, dtype=np.float32).reshape(2, 3), "count": np.array(7)}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Return a file of arrays."""
    save_arrays(tmp_path / "policy.safetensors", ARRAYS, {"task": "push"})
    return tmp_path / "policy.safetensors"


def with_layout(path: Path, change: Callable[[dict[str, Any]], Any]) -> None:
    """Replace the description of the arrays in a file."""
    content = path.read_bytes()
    size = int.from_bytes(content[:8], "little")
    layout = json.loads(content[8 : 8 + size])
    change(layout)
    header = json.dumps(layout).encode()
    path.write_bytes(len(header).to_bytes(8, "little") + header + content[8 + size :])


def test_arrays_and_header_are_restored(path: Path) -> None:
    arrays, header = load_arrays(path)
    assert header == {"task": "push"}
    assert {name: array.tolist() for name, array in arrays.items()} == {"weights": [[0, 1, 2], [3, 4, 5]], "count": 7}
    check_arrays(path)


@pytest.mark.parametrize(
    "change",
    [
        lambda layout: layout["weights"].update(shape=[2**40, 2**40]),
        lambda layout: layout["weights"].update(data_offsets=[0, 2**60]),
        lambda layout: layout["weights"].update(data_offsets=[-8, 16]),
        lambda layout: layout["weights"].update(data_offsets=["0", "24"]),
        lambda layout: layout["weights"].update(dtype="F1024"),
        lambda layout: layout["weights"].pop("data_offsets"),
        lambda layout: layout.pop("__metadata__"),
    ],
)
def test_an_absurd_description_is_refused(path: Path, change: Callable[[dict[str, Any]], Any]) -> None:
    with_layout(path, change)
    with pytest.raises(ValueError, match="damaged"):
        load_arrays(path)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\0" * 8,
        (2**40).to_bytes(8, "little") + b"{}",
        (100_000).to_bytes(8, "little") + b"[" * 50_000 + b"]" * 50_000,
        b"\x80\x04\x95",
    ],
)
def test_another_kind_of_file_is_refused(path: Path, content: bytes) -> None:
    path.write_bytes(content)
    with pytest.raises(ValueError, match="damaged or not written by codesign-bench"):
        load_arrays(path)
    with pytest.raises(DamagedFile):
        check_arrays(path)


def test_a_flipped_bit_is_found_without_loading(path: Path) -> None:
    content = path.read_bytes()
    path.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    with pytest.raises(DamagedFile, match="checksum does not match"):
        check_arrays(path)


def test_bytes_that_are_added_at_its_end_are_found(path: Path) -> None:
    path.write_bytes(path.read_bytes() + bytes(8))
    with pytest.raises(DamagedFile, match="missing or added at its end"):
        check_arrays(path)


def test_what_is_no_file_of_arrays_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "loop").symlink_to("loop")
    with (tmp_path / "large").open("wb") as stream:
        stream.truncate(2**40)
    for name, kind in (("pipe", DamagedFile), ("large", DamagedFile), ("loop", UnreadableFile)):
        for read in (load_arrays, check_arrays):
            with pytest.raises(UnusableFile) as caught:
                read(tmp_path / name)
            assert type(caught.value) is kind
