"""How often a cell in training is saved, by a clock that the test holds."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from codesign_bench.cell.cell import Cell, resolve_cell
from codesign_bench.sweep import training
from codesign_bench.sweep.training import CHECKPOINT_SECONDS_VARIABLE, PAUSE_PER_SAVE, CellRun

pytestmark = pytest.mark.usefixtures("toy")
CELL = Cell("toy_reach", "toy_search", 0, steps=6_000, overrides=("evaluations=1",))
TICK = 0.001


class Clock:
    """Moves on by a tick whenever somebody looks at it."""

    def __init__(self) -> None:
        self.now = 0.0

    def monotonic(self) -> float:
        """Return the time, s."""
        self.now += TICK
        return self.now

    time = monotonic


def save_times(folder: Path, monkeypatch: pytest.MonkeyPatch, interval: float, seconds: float) -> list[float]:
    """Return when a cell is saved if a checkpoint is due every `interval` s and takes `seconds` to write."""
    clock, times = Clock(), []

    def save(*_: Any) -> None:
        times.append(clock.now)
        clock.now += seconds

    monkeypatch.setattr(training, "time", clock)
    monkeypatch.setattr(training, "save_checkpoint", save)
    monkeypatch.setenv(CHECKPOINT_SECONDS_VARIABLE, str(interval))
    CellRun(resolve_cell(CELL), folder).finish()
    return times[:-1]  # The last one is the last evaluation's, whenever that is.


def pauses(times: list[float]) -> list[float]:
    """Return the times between two saves."""
    return [later - earlier for earlier, later in pairwise(times)]


def test_a_checkpoint_is_made_after_every_interval(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = pauses(save_times(tmp_path, monkeypatch, interval=0.1, seconds=0.0))
    assert len(found) > 5
    assert all(0.1 <= pause < 0.1 + 20 * TICK for pause in found)


def test_one_that_takes_long_is_followed_by_a_long_pause(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = pauses(save_times(tmp_path, monkeypatch, interval=0.1, seconds=0.01))
    assert len(found) > 3
    assert all(PAUSE_PER_SAVE * 0.01 < pause < PAUSE_PER_SAVE * 0.013 + 20 * TICK for pause in found)


def test_an_interval_of_zero_means_every_batch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for seconds in (0.0, 10.0):
        assert len(save_times(tmp_path, monkeypatch, interval=0.0, seconds=seconds)) > 6_000 / 30
