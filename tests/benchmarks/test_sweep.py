"""`bench sweep` projects whole cells from some seconds of training."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from builders import toy_cells
from codesign_bench.benchmarks.sweep import project
from codesign_bench.cell.cell import resolve_cells
from codesign_bench.cli import main
from codesign_bench.sweep.pace import MEASURED, Pace

pytestmark = pytest.mark.usefixtures("toy")


def test_cells_per_hour_by_hand() -> None:
    (resolved,) = resolve_cells(toy_cells())  # 200 steps, 4 evaluations and the first
    found = project(resolved, [Pace(10.0, 2.0, 100.0, MEASURED), Pace(20.0, 2.0, 300.0, MEASURED)])
    assert (found.steps_per_second, found.together, found.peak_mb) == (15.0, 30.0, 300.0)
    assert found.cell_s == (30.0 + 20.0) / 2
    assert found.cells_per_hour == 3600.0 / 30.0 + 3600.0 / 20.0


def test_it_measures_and_writes_what_it_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "sweep.json"
    line = ["bench", "sweep", "--task", "toy_reach", "--method", "toy_search", "--profile", "quick", "--jobs", "2"]
    assert main([*line, "--out", str(out)]) == 0
    assert "toy_reach/toy_search" in capsys.readouterr().out
    (found,) = json.loads(out.read_text())["sweep"]
    assert (found["at_a_time"], found["profile"]) == (2, "quick")
    assert found["together"] > found["steps_per_second"] > 0.0


@pytest.mark.parametrize(
    ("changed", "named"),
    [
        (["--task", "pull"], "unknown task 'pull'"),
        (["--method", "guess"], "unknown method 'guess'"),
        (["--profile", "slow"], "unknown profile 'slow'"),
        (["--jobs", "0"], "--jobs"),
    ],
)
def test_what_cannot_be_measured_is_refused(changed: list[str], named: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "sweep", "--task", "toy_reach", "--method", "toy_search", *changed]) == 2
    assert named in capsys.readouterr().err
