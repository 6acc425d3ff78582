"""Scalars are the rows of curves and metrics, at their environment steps, and are written while cells run."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

from builders import rising, store_cell, sweep, toy_cells
from codesign_bench.cell.cell import Cell
from codesign_bench.errors import UserError
from codesign_bench.storage.cells import open_cell
from codesign_bench.storage.layout import CURVE_COLUMNS, CURVE_FILE, METRICS_FILE, write_rows
from codesign_bench.storage.records import RUNNING
from codesign_bench.sweep.tensorboard import FOLDER, Follower


def scalars(folder: Path, name: str) -> list[tuple[int, float]]:
    """Return step and value of a scalar of a cell, as TensorBoard itself reads them."""
    reading = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator")
    found: Any = reading.EventAccumulator(str(folder / FOLDER))
    found.Reload()
    return [(event.step, event.value) for event in found.Scalars(name)]


@pytest.fixture(autouse=True)
def needed() -> None:
    pytest.importorskip("tensorboard")


@pytest.mark.usefixtures("toy")
def test_a_sweep_writes_curves_and_metrics(tmp_path: Path) -> None:
    (cell,) = toy_cells()
    assert sweep([cell], tmp_path, tensorboard=True)[0] == 0
    folder = cell.folder(tmp_path)
    curve = open_cell(folder).curve()
    assert curve is not None
    expected = list(zip(curve["env_steps"], curve["return_mean"], strict=True))
    found = scalars(folder, "curve/return_mean")
    assert [step for step, _ in found] == [step for step, _ in expected]
    assert [value for _, value in found] == pytest.approx([value for _, value in expected], rel=1e-6)
    assert len(scalars(folder, "metrics/candidate_return")) == len(curve) - 1


def test_rows_are_written_as_they_come(tmp_path: Path) -> None:
    folder = store_cell(tmp_path, status=RUNNING, curve=rising(0.0, 1.0))
    with Follower([Cell("push", "gnn_ppo", 0)], tmp_path) as follower:
        follower.look()
        assert scalars(folder, "curve/return_mean") == [(0, 0.0), (100, 1.0)]
        zeros = dict.fromkeys(CURVE_COLUMNS, 0.0)
        write_rows(folder / CURVE_FILE, [{**zeros, **row} for row in rising(0.0, 1.0, 2.0)], CURVE_COLUMNS)
        write_rows(folder / METRICS_FILE, [{"env_steps": 100, "loss": 0.5}])
    assert scalars(folder, "curve/return_mean") == [(0, 0.0), (100, 1.0), (200, 2.0)]
    assert scalars(folder, "metrics/loss") == [(100, 0.5)]


def test_a_second_sweep_shows_nothing_twice(tmp_path: Path) -> None:
    folder = store_cell(tmp_path, status=RUNNING, curve=rising(0.0, 1.0))
    for _ in range(2):
        with Follower([Cell("push", "gnn_ppo", 0)], tmp_path):
            pass
    assert scalars(folder, "curve/return_mean") == [(0, 0.0), (100, 1.0)]


@pytest.mark.usefixtures("toy")
def test_without_the_package_nothing_runs_and_its_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", None)
    with pytest.raises(UserError, match=r"pip install 'codesign-bench\[tensorboard\]'"):
        sweep(toy_cells(), tmp_path / "runs", tensorboard=True)
    assert not (tmp_path / "runs").exists()
