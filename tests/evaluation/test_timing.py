"""Times are those of the cells' own records; policies are timed once for each task and method."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from builders import VERSION_0_1_0, store_cell
from codesign_bench.cell.variant import Variant
from codesign_bench.errors import UserError
from codesign_bench.evaluation import timing
from codesign_bench.evaluation.timing import inference_seconds, timing_frame
from codesign_bench.storage.cells import open_cell
from codesign_bench.storage.records import RUNNING, CellRecord


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """Two finished cells of two methods on push each, one interrupted cell, and one of another variant."""
    for name in ("gnn_ppo", "cma_es", "shared_arch"):
        shutil.copytree(VERSION_0_1_0 / "push" / name, tmp_path / "push" / name)
    store_cell(tmp_path, variant=Variant.of(alpha=0.3))
    return tmp_path


def test_finished_cells_that_vary_nothing_have_a_row(results: Path) -> None:
    frame = timing_frame(results)
    cells = [(row.method, row.seed) for row in frame.itertuples()]
    assert cells == [("cma_es", 0), ("cma_es", 1), ("gnn_ppo", 0), ("gnn_ppo", 1)]
    assert set(frame["task"]) == {"push"}


def test_a_row_repeats_its_cells_record(results: Path) -> None:
    row = timing_frame(results).iloc[2]
    record = CellRecord.read(results / "push" / "gnn_ppo" / "default" / "seed-00")
    assert record is not None
    assert (row["label"], row["profile"], row["env_steps"]) == (record.label, "quick", record.env_steps)
    assert (row["train_s"], row["cores"], row["cpu"]) == (record.timings.train_s, record.threads, record.host["cpu"])


def test_one_seed_of_each_task_and_method_is_timed(results: Path) -> None:
    frame = timing_frame(results)
    assert frame["inference_s"].notna().tolist() == [True, False, True, False]
    assert frame["inference_s"].dropna().between(1e-7, 1.0).all()


def test_a_policy_that_fits_its_task_no_more_is_not_timed(results: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(timing, "misfit", lambda cell: "another observation" if cell.record.seed == 0 else "")
    frame = timing_frame(results)
    assert frame["inference_s"].notna().tolist() == [False, True, False, True]


def test_a_call_of_a_policy_takes_some_time(results: Path) -> None:
    assert 0.0 < inference_seconds(open_cell(results / "push" / "gnn_ppo" / "default" / "seed-00")) < 1.0


def test_without_a_finished_cell_the_way_to_one_is_told(tmp_path: Path) -> None:
    store_cell(tmp_path, status=RUNNING)
    with pytest.raises(UserError, match="create some with: codesign-bench run --method"):
        timing_frame(tmp_path)
