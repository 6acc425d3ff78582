"""The pace of a cell: of finished cells, or measured in a process of its own and kept."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from builders import sweep, toy_cells
from codesign_bench.cell.cell import ResolvedCell, resolve_cells
from codesign_bench.cell.variant import Variant
from codesign_bench.config.settings import Sourced, StoredConfig
from codesign_bench.storage.cells import find_cells
from codesign_bench.storage.records import CellRecord, Timings
from codesign_bench.sweep.pace import (
    CACHE_VARIABLE,
    FINISHED,
    MEASURED,
    NotTimed,
    Pace,
    cache_file,
    kind_of,
    kind_of_record,
    measure,
    measured_before,
    of_finished,
    remember,
)

pytestmark = pytest.mark.usefixtures("toy")

PACE = Pace(steps_per_second=100.0, evaluation_s=2.0, peak_mb=300.0, source=MEASURED)


@pytest.fixture(autouse=True)
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let nothing have been measured yet."""
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "cache"))


def resolved(**changes: object) -> ResolvedCell:
    """Return a toy cell."""
    return resolve_cells(toy_cells(**changes))[0]  # type: ignore[arg-type]


def records(out: Path) -> list[CellRecord]:
    """Return the records of a results folder."""
    return [cell.record for cell in find_cells(out)]


def test_a_cell_takes_the_time_of_its_steps_and_of_its_evaluations() -> None:
    assert PACE.seconds(1_000, evaluations=5) == 1_000 / 100.0 + 5 * 2.0


def test_cells_of_a_kind_differ_in_seed_budget_and_variant_alone() -> None:
    kind = kind_of(resolved())
    assert kind == kind_of(resolved(steps=5_000)) == kind_of(resolved(variants=[Variant.of(cutout=0.4)]))
    assert kind != kind_of(resolved(overrides=("episodes=9",)))
    assert kind != kind_of(resolved(overrides=("threads=2",)))


def test_a_stored_cell_is_of_the_kind_that_it_was_run_as(tmp_path: Path) -> None:
    sweep(toy_cells(), tmp_path / "runs")
    (record,) = records(tmp_path / "runs")
    assert kind_of_record(record) == kind_of(resolved())
    elsewhere = replace(record, host={**record.host, "cpu": "another processor"})
    assert kind_of_record(elsewhere) != kind_of(resolved())


def test_the_pace_of_finished_cells_is_their_mean(tmp_path: Path) -> None:
    sweep(toy_cells(2), tmp_path / "runs")
    times = [Timings(train_s=2.0, evaluate_s=5.0, peak_mb=100.0), Timings(train_s=6.0, evaluate_s=10.0, peak_mb=90.0)]
    timed = [
        replace(record, env_steps=400, timings=own)
        for record, own in zip(records(tmp_path / "runs"), times, strict=True)
    ]
    # Two cells of 400 steps took 8 s; five evaluations each took 15 s.
    assert of_finished(timed) == {kind_of(resolved()): Pace(100.0, 1.5, 100.0, FINISHED)}


def test_a_cell_that_is_not_done_or_was_not_timed_tells_no_pace(tmp_path: Path) -> None:
    sweep(toy_cells(), tmp_path / "runs")
    (record,) = records(tmp_path / "runs")
    assert of_finished([replace(record, status="failed"), replace(record, timings=Timings())]) == {}


def test_a_finished_cell_records_its_memory(tmp_path: Path) -> None:
    sweep(toy_cells(), tmp_path / "runs")
    (record,) = records(tmp_path / "runs")
    assert record.timings.peak_mb is not None
    assert 20.0 < record.timings.peak_mb < 4_000.0


def test_what_was_measured_is_kept() -> None:
    assert measured_before() == {}
    remember({"one": PACE})
    remember({"two": replace(PACE, peak_mb=None)})
    assert measured_before() == {"one": PACE, "two": replace(PACE, peak_mb=None)}


@pytest.mark.parametrize(
    "content", ["", "[1]", '{"one": 3}', '{"one": {"steps_per_second": 0.0, "evaluation_s": 1.0}}', "{" * 100_000]
)
def test_a_damaged_cache_is_an_empty_one(content: str) -> None:
    cache_file().parent.mkdir(parents=True)
    cache_file().write_text(content)
    assert measured_before() == {}
    remember({"one": PACE})
    assert measured_before() == {"one": PACE}


def test_a_cache_that_cannot_be_written_costs_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "file"))
    remember({"one": PACE})
    assert measured_before() == {}


def test_cells_are_measured_side_by_side_and_leave_nothing_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    paces = measure(resolved(), at_a_time=2)
    assert len(paces) == 2
    for pace in paces:
        assert pace.steps_per_second > 0.0
        assert pace.evaluation_s > 0.0
        assert pace.peak_mb is not None
        assert pace.peak_mb > 20.0
    assert list(tmp_path.iterdir()) == []


def test_a_measurement_that_fails_says_why_in_one_line() -> None:
    line = r"^toy_reach/toy_search cannot be timed: RuntimeError: the toy broke$"
    with pytest.raises(NotTimed, match=line):
        measure(resolved(overrides=("fail_at=50",)))
    with pytest.raises(NotTimed, match="cannot be timed: the cell's process was killed by SIGKILL"):
        measure(resolved(overrides=("die_at=50",)))


@pytest.mark.parametrize(
    "changed",
    [
        {"env_steps": -1},
        {"timings": Timings(train_s=-1.0, evaluate_s=1.0)},
        {"timings": Timings(train_s=1.0, evaluate_s=-1.0)},
        *({"config": StoredConfig(run=run)} for run in ({}, {"evaluations": Sourced("many", "x")})),
        {"config": StoredConfig(run={"evaluations": Sourced(-1, "x")})},
    ],
)
def test_a_record_whose_numbers_cannot_be_tells_no_pace(tmp_path: Path, changed: dict[str, Any]) -> None:
    sweep(toy_cells(), tmp_path / "runs")
    (record,) = records(tmp_path / "runs")
    assert len(of_finished([record])) == 1
    assert of_finished([replace(record, **changed)]) == {}


def test_the_cache_is_json_that_people_can_read() -> None:
    remember({"one": PACE})
    assert json.loads(cache_file().read_text())["one"]["steps_per_second"] == 100.0
