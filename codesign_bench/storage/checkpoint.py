"""All that an interrupted cell needs to go on bit for bit, in one file without pickle."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load, save

from codesign_bench.errors import UserError
from codesign_bench.method import Array, State
from codesign_bench.storage.files import dump_json, write_bytes

HEADER = "codesign_bench"
"""The key of the JSON header in the file's metadata."""


@dataclass
class Progress:
    """Where a cell stands; the curve's rows are part of it, so that file and learner can never disagree."""

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
    """Seconds since the cell's start, time between interruption and resumption left out."""


@dataclass(frozen=True)
class Checkpoint:
    """A cell in the middle of its training."""

    state: State
    streams: dict[str, Any]
    progress: Progress


def save_arrays(path: Path, arrays: Mapping[str, Array], header: Mapping[str, Any]) -> None:
    """Replace `path` by `arrays` and a JSON `header`, guarded by a checksum."""
    ordered = {name: np.asarray(array, order="C") for name, array in arrays.items()}
    text = dump_json({**header, "checksum": _checksum(ordered)})
    write_bytes(path, save(ordered, metadata={HEADER: text}))


def load_arrays(path: Path) -> tuple[dict[str, Array], dict[str, Any]]:
    """Return arrays and header that `save_arrays` wrote.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: it is damaged or something else.
    """
    content = path.read_bytes()
    try:
        size = int.from_bytes(content[:8], "little")
        header = json.loads(json.loads(content[8 : 8 + size])["__metadata__"][HEADER])
        arrays: dict[str, Array] = load(content)
    except (SafetensorError, ValueError, KeyError, TypeError) as error:
        raise ValueError("damaged or not written by codesign-bench") from error
    if header.pop("checksum") != _checksum(arrays):
        raise ValueError("damaged: its checksum does not match")
    return arrays, header


def save_checkpoint(path: Path, checkpoint: Checkpoint) -> None:
    """Replace `path` by `checkpoint` in one step."""
    header = {
        "values": checkpoint.state.values,
        "streams": checkpoint.streams,
        "progress": vars(checkpoint.progress),
    }
    save_arrays(path, checkpoint.state.arrays, header)


def load_checkpoint(path: Path) -> Checkpoint | None:
    """Return the checkpoint in `path`, or None when there is none.

    Raises:
        UserError: it is truncated or damaged.
    """
    try:
        arrays, header = load_arrays(path)
        return Checkpoint(State(arrays, header["values"]), header["streams"], Progress(**header["progress"]))
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError, OSError) as error:
        raise UserError(f"checkpoint {path} is unusable ({error}); delete it to start its cell again") from error


def _checksum(arrays: Mapping[str, Array]) -> int:
    total = 0
    for name in sorted(arrays):
        total = zlib.crc32(arrays[name].tobytes(), zlib.crc32(name.encode(), total))
    return total
