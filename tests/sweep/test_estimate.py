"""What a sweep will take: time and memory of the cells that are to be run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from builders import sweep, toy_cells
from codesign_bench.cell.cell import Cell, resolve_cells
from codesign_bench.sweep.estimate import START_SECONDS, estimate, fitting, known_paces, row, untimed
from codesign_bench.sweep.pace import CACHE_VARIABLE, FINISHED, MEASURED, Pace, kind_of, remember
from codesign_bench.sweep.plan import Pending, make_plan

pytestmark = pytest.mark.usefixtures("toy")

PACE = Pace(steps_per_second=10.0, evaluation_s=2.0, peak_mb=300.0, source=MEASURED)


@pytest.fixture(autouse=True)
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let nothing have been measured yet."""
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "cache"))


def pending(count: int, env_steps: int = 0, **changes: object) -> list[Pending]:
    """Return cells to be run, 200 steps and 4 evaluations each."""
    return [Pending(cell, env_steps) for cell in resolve_cells(toy_cells(count, **changes))]  # type: ignore[arg-type]


def test_cells_share_the_jobs() -> None:
    cells = pending(3)
    found = estimate(cells, 2, {kind_of(cells[0].resolved): PACE})
    # 20 s of training and five evaluations, of which one is before any training.
    each = START_SECONDS + 20.0 + 5 * 2.0
    assert [cell.seconds for cell in found.cells] == [each] * 3
    assert found.seconds == 2 * each
    assert found.megabytes == 600.0
    assert found.line().startswith("expected to take 70 s, up to 0.6 GB of memory")


def test_a_cell_that_resumes_takes_less() -> None:
    (cell,) = pending(1, env_steps=150)
    (expected,) = estimate([cell], 1, {kind_of(cell.resolved): PACE}).cells
    assert expected.state == "resume at 75%"
    assert expected.seconds == START_SECONDS + 5.0 + 2 * 2.0


def test_a_kind_that_was_not_timed_is_said_to_be_unknown() -> None:
    timed, other = pending(1), pending(2, overrides=("evaluations=4", "episodes=9"))
    known = {kind_of(timed[0].resolved): PACE}
    assert list(untimed([*timed, *other], known).values()) == other[:1]
    found = estimate([*timed, *other], 2, known)
    assert found.unknown == 2
    assert "and 2 cells of unknown speed" in found.line()
    assert estimate(other, 2, known).line().startswith("expected time unknown")
    assert row(found.cells[-1])[1:] == ("run", "200", "unknown", "unknown", "")


def test_finished_cells_tell_more_than_a_measurement(tmp_path: Path) -> None:
    sweep(toy_cells(1), tmp_path / "runs")
    (resolved,) = resolve_cells(toy_cells(1))
    remember({kind_of(resolved): PACE})
    assert known_paces(tmp_path / "elsewhere") == {kind_of(resolved): PACE}
    assert known_paces(tmp_path / "runs")[kind_of(resolved)].source == FINISHED


def test_steps_of_a_checkpoint_count_as_taken(tmp_path: Path) -> None:
    broken = Cell("toy_reach", "toy_search", seed=0, steps=200, overrides=("evaluations=4", "fail_at=150"))
    sweep([broken], tmp_path / "runs")
    (cell,) = make_plan(resolve_cells([broken]), tmp_path / "runs", retry_failed=True).pending
    (expected,) = estimate([cell], 1, {}).cells
    assert expected.state == f"resume at {cell.env_steps / 200:.0%}"
    assert cell.env_steps >= 50


def test_cells_that_do_not_fit_in_the_memory_do_not_run_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    cells = pending(4)
    kind = kind_of(cells[0].resolved)
    monkeypatch.setattr("codesign_bench.sweep.estimate.total_megabytes", lambda: 1_000.0)
    monkeypatch.setattr("codesign_bench.sweep.estimate.total_gpu_megabytes", lambda: 2_000.0)
    assert fitting(cells, {}) is None
    assert fitting(cells, {kind: PACE}) == 2  # of 300 MB each in 800
    assert fitting(cells, {kind: replace(PACE, gpu_mb=500.0)}) == 2
    assert fitting(cells, {kind: replace(PACE, gpu_mb=1_500.0)}) == 1
    assert fitting(cells, {kind: replace(PACE, peak_mb=5_000.0)}) == 1
