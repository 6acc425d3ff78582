"""A sweep runs what is missing, records what fails, refuses what differs, and never uses more cores than there are."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from builders import sweep
from builders import toy_cells as cells
from codesign_bench import load_results
from codesign_bench.cell.cell import Cell, resolve_cells
from codesign_bench.errors import UserError
from codesign_bench.storage.layout import CHECKPOINT_FILE, open_folder
from codesign_bench.storage.records import CellRecord
from codesign_bench.sweep.runner import make_plan, split_cores
from toy import ToyReach

pytestmark = pytest.mark.usefixtures("toy")

CELL = Cell("toy_reach", "toy_search", seed=0, steps=200, overrides=("evaluations=4",))


def stored(cell: Cell, out: Path) -> CellRecord:
    """Return the record of a cell that has run."""
    record = CellRecord.read(cell.folder(out))
    assert record is not None
    return record


def test_a_second_run_skips_what_is_done_and_runs_what_is_new(tmp_path: Path) -> None:
    sweep(cells(1), tmp_path)
    before = (CELL.folder(tmp_path) / "curve.csv").read_bytes()
    code, text = sweep(cells(2), tmp_path)
    assert code == 0
    assert "2 cells, 1 of them already done" in text
    assert (CELL.folder(tmp_path) / "curve.csv").read_bytes() == before
    assert load_results(tmp_path)["seed"].unique().tolist() == [0, 1]


def test_a_finished_cell_whose_curve_has_changed_is_told_and_left_alone(tmp_path: Path) -> None:
    sweep(cells(2), tmp_path)
    curve = CELL.folder(tmp_path) / "curve.csv"
    curve.write_text(curve.read_text() + curve.read_text().splitlines(keepends=True)[-1])
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    for retry_failed in (False, True):
        code, text = sweep(cells(2), tmp_path, retry_failed=retry_failed)
        assert code == 1
        assert "curve.csv: its checksum does not match; delete its folder to run it again" in " ".join(text.split())
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_a_copy_of_another_cell_is_never_taken_for_the_cell(tmp_path: Path) -> None:
    sweep(cells(1), tmp_path)
    shutil.copytree(CELL.folder(tmp_path), CELL.folder(tmp_path).with_name("seed-01"))
    with pytest.raises(UserError, match=r"seed-01.*is that of the cell toy_reach/toy_search/default/seed-00"):
        sweep(cells(2), tmp_path)


def test_the_curve_does_not_depend_on_the_number_of_jobs(tmp_path: Path) -> None:
    assert sweep(cells(2), tmp_path / "one", jobs=1)[0] == 0
    assert sweep(cells(2), tmp_path / "two", jobs=2)[0] == 0
    frames = [load_results(tmp_path / name).drop(columns="wall_s") for name in ("one", "two")]
    assert frames[0].equals(frames[1])


def test_a_cell_that_raises_is_recorded_and_the_rest_go_on(tmp_path: Path) -> None:
    broken = cells(1, overrides=("evaluations=4", "fail_at=50"))
    good = [Cell("toy_reach", "toy_search", seed=1, steps=100)]
    code, text = sweep([*broken, *good], tmp_path)
    assert code == 1
    assert "the toy broke" in text
    failed = stored(broken[0], tmp_path)
    assert failed.status == "failed"
    assert failed.failure is not None
    assert "RuntimeError: the toy broke" in failed.failure.traceback
    assert failed.env_steps >= 50
    assert stored(good[0], tmp_path).status == "done"


def test_a_failed_cell_is_reported_and_retried_only_when_asked(tmp_path: Path) -> None:
    broken = cells(1, overrides=("evaluations=4", "fail_at=50"))
    sweep(broken, tmp_path)
    ended = stored(broken[0], tmp_path).timings.ended
    code, text = sweep(broken, tmp_path)
    assert (code, "failed earlier" in text) == (1, True)
    assert stored(broken[0], tmp_path).timings.ended == ended
    plan = make_plan(resolve_cells(broken), tmp_path, retry_failed=True)
    assert [resolved.cell for resolved in plan.pending] == broken


def test_a_process_that_is_killed_is_named_and_the_sweep_goes_on(tmp_path: Path) -> None:
    killed = cells(1, overrides=("evaluations=4", "die_at=50"))
    good = [Cell("toy_reach", "toy_search", seed=1, steps=100)]
    code, text = sweep([*killed, *good], tmp_path, jobs=1)
    assert code == 1
    assert "killed by SIGKILL" in str(stored(killed[0], tmp_path).failure)
    assert "killed by SIGKILL" in text
    assert stored(good[0], tmp_path).status == "done"


def test_another_configuration_is_refused_with_the_difference(tmp_path: Path) -> None:
    sweep([CELL], tmp_path)
    with pytest.raises(UserError, match="episodes: stored 4, requested 5") as caught:
        make_plan(resolve_cells(cells(2, overrides=("evaluations=4", "episodes=5"))), tmp_path)
    assert CELL.name in str(caught.value)
    assert str(caught.value).count("\n") <= 1
    with pytest.raises(UserError, match="steps: stored 200, requested 300"):
        make_plan(resolve_cells(cells(1, steps=300)), tmp_path)
    assert make_plan(resolve_cells(cells(1, profile="quick")), tmp_path).done


def test_cells_of_another_version_of_their_task_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sweep([CELL], tmp_path)
    monkeypatch.setattr(ToyReach, "version", 2)
    with pytest.raises(UserError, match="version of task 'toy_reach': stored 1, requested 2"):
        make_plan(resolve_cells(cells(1)), tmp_path)


def test_a_truncated_checkpoint_is_refused_before_anything_runs(tmp_path: Path) -> None:
    open_folder(tmp_path)
    folder = CELL.folder(tmp_path)
    folder.mkdir(parents=True)
    (folder / CHECKPOINT_FILE).write_bytes(b"\x10\x00")
    with pytest.raises(UserError, match=CHECKPOINT_FILE):
        sweep([CELL], tmp_path)
    assert not (folder / "cell.json").exists()


@pytest.mark.parametrize(
    ("cores", "count", "threads", "jobs", "used"),
    [
        (2, 30, 1, None, 2),
        (2, 30, 1, 1, 1),
        (2, 30, 1, 64, 2),
        (8, 3, 1, None, 3),
        (8, 30, 3, None, 2),
        (1, 5, 1, 4, 1),
    ],
)
def test_jobs_times_threads_never_exceeds_the_cores(
    cores: int, count: int, threads: int, jobs: int | None, used: int
) -> None:
    found, line = split_cores(cores, count, threads, jobs)
    assert found == used
    assert found * threads <= cores
    assert (jobs is not None and jobs * threads > cores) == ("would need more cores" in line)
    with pytest.raises(UserError, match="cores"):
        split_cores(cores, count, cores + 1, jobs)
