"""Progress: what the running cells tell of themselves, added up."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from builders import store_cell
from builders import toy_cells as cells
from codesign_bench.cell.cell import Cell
from codesign_bench.storage.files import write_json
from codesign_bench.storage.layout import PROGRESS_FILE
from codesign_bench.storage.records import Timings
from codesign_bench.sweep.progress import ProgressDisplay, seconds_until_done


def test_progress_adds_up_the_running_cells(tmp_path: Path) -> None:
    one, two = cells(2)
    display = ProgressDisplay(Console(file=io.StringIO()), tmp_path, {one: 200, two: 200})
    one.folder(tmp_path).mkdir(parents=True)
    content = {"updated": 1e12, "env_steps": 100, "steps": 200, "steps_per_second": 50.0}
    write_json(one.folder(tmp_path) / PROGRESS_FILE, content)
    found = display.snapshot()
    assert ([cell for cell, _ in found.running], found.finished, found.cells) == ([one], 0, 2)
    assert found.seconds_left == pytest.approx((100 + 200) / 50.0)
    assert found.line() == "0/2 cells ended, 1 running, 50 steps/s, about 6 s left"
    event = found.to_json()
    assert event["running"][0] | {"phase": ""} == {
        **{"cell": one.name, "phase": "", "env_steps": 100, "steps": 200, "steps_per_second": 50.0},
        **{"return_mean": None, "success_rate": None},
    }
    assert event["seconds_left"] == found.seconds_left
    write_json(one.folder(tmp_path) / PROGRESS_FILE, {**content, "updated": 0.0})
    assert display.snapshot().running == []
    display.ended(one)
    assert display.snapshot().finished == 1


def report(cell: Cell, out: Path, env_steps: int, speed: float) -> None:
    """Write what a running cell tells of itself."""
    cell.folder(out).mkdir(parents=True, exist_ok=True)
    content = {"updated": 1e12, "env_steps": env_steps, "steps": 200, "steps_per_second": speed}
    write_json(cell.folder(out) / PROGRESS_FILE, content)


def display_of(out: Path, cells: list[Cell], workers: int) -> ProgressDisplay:
    return ProgressDisplay(Console(file=io.StringIO()), out, dict.fromkeys(cells, 200), workers)


def test_a_slow_method_is_not_judged_by_a_fast_one(tmp_path: Path) -> None:
    fast, slow = cells(2), [replace(cell, method="slow") for cell in cells(2)]
    display = display_of(tmp_path, [*fast, *slow], workers=1)
    report(fast[0], tmp_path, 100, 50.0)
    assert display.snapshot().line().endswith("at least 6 s left, and 2 cells of unknown speed")
    report(slow[0], tmp_path, 100, 1.0)
    found = display.snapshot()  # two run; the faster goes on with the other fast one, and then the other slow one
    assert (found.unknown, found.seconds_left) == (0, pytest.approx(100 / 50.0 + 200 / 50.0 + 200 / 1.0))


def test_between_two_waves_the_speed_of_the_first_counts(tmp_path: Path) -> None:
    first, second, third = cells(3)
    display = display_of(tmp_path, [first, second, third], workers=2)
    assert display.snapshot().line() == "0/3 cells ended, 0 running, cells are starting, time left unknown"
    store_cell(tmp_path, task=first.task, method=first.method, env_steps=200, timings=Timings(wall_s=20.0))
    display.ended(first)
    assert display.snapshot().line() == "1/3 cells ended, 0 running, cells are starting, about 20 s left"


@pytest.mark.parametrize(
    ("seconds", "workers", "until"), [((), 2, 0.0), ((3.0, 2.0, 2.0), 1, 7.0), ((3.0, 2.0, 2.0), 2, 4.0)]
)
def test_cells_are_run_in_turn_by_whoever_is_free(seconds: tuple[float, ...], workers: int, until: float) -> None:
    assert seconds_until_done(seconds, workers) == until
