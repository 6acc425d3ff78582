"""What a search will take: what is left of it, and how long that takes."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from rich.console import Console

from builders import BUDGET, store_cell
from codesign_bench.cell.variant import Variant
from codesign_bench.study.tuning import Tuning
from codesign_bench.sweep.estimate import START_SECONDS
from codesign_bench.sweep.pace import Pace, kind_of
from codesign_bench.tuning.expected import dry_run, expected, samples

pytestmark = pytest.mark.usefixtures("toy")
TUNING = Tuning(methods=("toy_search",), tasks=("toy_reach",), settings=3, rungs=2)
STEPS = 300
CELLS = (3 + 1) * 2
"""Two rungs of three settings and of one, with two seeds each."""
TAKEN = (3 * 100 + 1 * 300) * 2


def test_time_follows_from_the_speed_of_one_setting(tmp_path: Path) -> None:
    (cell,) = samples(TUNING, "quick", STEPS).values()
    known = {kind_of(cell): Pace(100.0, 0.5, None, "measured")}
    found = expected(TUNING, "quick", STEPS, tmp_path, 1, known)
    seconds = TAKEN / 100.0 + CELLS * (START_SECONDS + 2 * 0.5)
    assert found.seconds == pytest.approx(seconds)
    assert found.line() == f"to run: at most 8 cells, 1,200 environment steps, about {seconds:.0f} s with 1 at a time"
    assert (found.to_json()["to_run"], found.to_json()["steps"]) == (8, 1_200)


def test_cells_that_are_done_are_taken_off(tmp_path: Path) -> None:
    variant = Variant.of(rung=0, setting=0)
    store_cell(tmp_path, task="toy_reach", method="toy_search", variant=variant, config=BUDGET)
    found = expected(TUNING, "quick", 3_000, tmp_path, 1, {})
    assert (found.parts[0].cells, found.parts[0].env_steps) == (CELLS - 1, 10 * TAKEN - 1_000)
    assert "unknown time" in found.line()


def test_a_dry_run_times_one_setting_and_runs_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    console = Console(record=True, width=200, file=io.StringIO())
    assert dry_run(console, TUNING, "quick", STEPS, tmp_path / "tuning", 1) == 0
    lines = console.export_text().splitlines()
    assert lines.count("timing toy_reach/toy_search ...") == 1
    assert lines[-2].startswith("to run: at most 8 cells, 1,200 environment steps, about ")
    assert lines[-1] == "nothing was run"
    assert not (tmp_path / "tuning").exists()
