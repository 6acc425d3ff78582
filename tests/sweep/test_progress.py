"""Progress: what the running cells tell of themselves, added up."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from rich.console import Console

from builders import toy_cells as cells
from codesign_bench.storage.files import write_json
from codesign_bench.storage.layout import PROGRESS_FILE
from codesign_bench.sweep.progress import ProgressDisplay


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
    write_json(one.folder(tmp_path) / PROGRESS_FILE, {**content, "updated": 0.0})
    assert display.snapshot().running == []
    display.ended(one)
    assert display.snapshot().finished == 1
