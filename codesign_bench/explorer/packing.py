"""Numbers as text in a page: integers as planes of bytes, compressed, in base64.

Shapes: `T` frames, `N` numbers of a frame.
"""

from __future__ import annotations

import base64
import gzip
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from .programs import LONG, Program, rounded

LARGEST = 8_000
"""Largest pose in its unit: finer than a screen shows, and changes of it fit in 16 bits."""
UNITS = (1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1, 0.2, 0.5, 1.0, 10.0, 100.0, 1e3, 1e6)
"""Units of poses, m and rad; the smallest that fits is used."""


def text(content: bytes) -> str:
    """Return compressed bytes as text."""
    # Without a time and at a fixed level, the same content gives the same text.
    return base64.b64encode(gzip.compress(content, compresslevel=9, mtime=0)).decode("ascii")


def planes(values: np.ndarray, count: int) -> bytes:
    """Return integers as their lowest bytes, then their next bytes, and so on; negative ones in two's complement."""
    whole = np.asarray(values, dtype="<i4").ravel()
    return whole.view(np.uint8).reshape(-1, 4)[:, :count].T.tobytes()


def pack_singles(values: np.ndarray) -> str:
    """Return numbers in single precision as text."""
    return text(np.asarray(values, dtype="<f4").tobytes())


def pack_program(program: Program, bits: int) -> dict[str, Any]:
    """Return a program, whose weights were rounded to `bits`, as JSON values.

    Its bytes are the short constants in single precision, then the planes of every long one.
    """
    count = -(-bits // 8)
    short = [constant for constant in program.constants if constant.size < LONG]
    content = [np.asarray(constant, dtype="<f4").tobytes() for constant in short]
    steps = []
    for constant in program.constants:
        step = 0.0
        if constant.size >= LONG:
            step = rounded(constant, bits)[0]
            content.append(planes(np.rint(constant / step), count))
        steps.append([int(constant.size), step])
    operations = [list(operation) for operation in program.operations]
    return {"operations": operations, "constants": steps, "planes": count, "content": text(b"".join(content))}


def unit_of(frames: Sequence[Sequence[Sequence[float]]]) -> float:
    """Return the smallest unit in which no pose is above `LARGEST`."""
    largest = max((abs(value) for rows in frames for row in rows for value in row), default=0.0)
    return next((unit for unit in UNITS if largest <= LARGEST * unit), UNITS[-1])


def pack_frames(frames: Sequence[Sequence[Sequence[float]]], structures: Sequence[Sequence[int]]) -> dict[str, Any]:
    """Return the poses of episodes, T frames of N numbers each, as JSON values.

    Poses are whole multiples of a unit. Per episode and run of frames of the same structure, every number's first value
    comes first and then its changes, number by number.
    """
    unit = unit_of(frames)
    columns = [
        np.diff(np.rint(np.array(rows[start:end]) / unit).astype(int), axis=0, prepend=0).T.ravel()
        for rows, numbers in zip(frames, structures, strict=True)
        for start, end in runs(numbers)
    ]
    values = np.concatenate(columns) if columns else np.zeros(0, dtype=int)
    return {
        "unit": unit,
        "structures": [[[int(numbers[start]), end - start] for start, end in runs(numbers)] for numbers in structures],
        # Changes of 16-bit numbers, kept in 16 bits: they wrap around, and so do the sums that undo them.
        "content": text(planes(values, 2)),
    }


def runs(numbers: Sequence[int]) -> list[tuple[int, int]]:
    """Return start and end of every run of equal numbers."""
    starts = [0, *(place for place in range(1, len(numbers)) if numbers[place] != numbers[place - 1]), len(numbers)]
    return [(start, end) for start, end in pairwise(starts) if end > start]
