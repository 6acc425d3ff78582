"""Numbers survive the way into a page and out of it again."""

from __future__ import annotations

import base64
import gzip

import numpy as np
import pytest

from codesign_bench.explorer.packing import pack_frames, pack_singles, planes, runs, text, unit_of


def unpacked(content: str) -> bytes:
    """Return the bytes of a text."""
    return gzip.decompress(base64.b64decode(content))


def test_the_same_content_gives_the_same_text() -> None:
    assert text(b"abc" * 100) == text(b"abc" * 100)
    assert unpacked(text(b"abc")) == b"abc"
    assert np.frombuffer(unpacked(pack_singles(np.array([0.5, -3.0]))), "<f4").tolist() == [0.5, -3.0]


def test_planes_hold_low_bytes_first_and_negative_numbers() -> None:
    assert planes(np.array([1, -2, 300]), 2) == bytes([1, 254, 44, 0, 255, 1])


def test_frames_are_changes_of_whole_units() -> None:
    packed = pack_frames([[[0.1, -3.0], [0.2, -3.0]], [[0.0, 1.0]]], [[0, 0], [1]])
    assert packed["unit"] == pytest.approx(5e-4)
    assert packed["structures"] == [[[0, 2]], [[1, 1]]]
    low, high = np.frombuffer(unpacked(packed["content"]), np.uint8).reshape(2, -1).astype(int)
    values = (low + 256 * high + 2**15) % 2**16 - 2**15
    assert values.tolist() == [200, 200, -6000, 0, 0, 2000]


def test_the_unit_grows_with_the_scene_and_runs_are_found() -> None:
    assert unit_of([[[40.0]]]) == pytest.approx(5e-3)
    assert unit_of([]) == pytest.approx(1e-4)
    assert runs([3, 3, 4, 3]) == [(0, 2), (2, 3), (3, 4)]
    assert runs([]) == []
