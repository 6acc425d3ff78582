"""A sweep runs what is missing, records what fails, refuses what differs, and never uses more cores than there are."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from builders import sweep
from builders import toy_cells as cells
from codesign_bench import load_results
from codesign_bench.cell.cell import Cell
from codesign_bench.cell.variant import Variant
from codesign_bench.errors import UserError
from codesign_bench.storage.layout import CHECKPOINT_FILE, LOG_FILE, MARKER_FILE, PROGRESS_FILE, open_folder
from codesign_bench.storage.locks import LOCK_FILE
from codesign_bench.storage.records import CellRecord
from codesign_bench.sweep.runner import last_row, split_cores

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


HEADER = "env_steps,wall_s,return_mean,return_se,success_rate,episode_length\n"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            HEADER + "0,0,0,0,0,9\n210,12.4,1.254,,0.5,8\n",
            "return 1.25, success 0.50, 210 steps (5% over the budget), 12 s",
        ),
        (
            HEADER + "0,0,0,0,0,9\n210,12.4,1.2",
            "its curve cannot be read (could not convert string to float: 'cut off')",
        ),
        (HEADER, "its curve cannot be read (list index out of range)"),
        ("return_mean\n1.0\n", "its curve cannot be read ('env_steps')"),
    ],
)
def test_the_end_of_a_curve_is_put_in_words(content: str, message: str, tmp_path: Path) -> None:
    CELL.folder(tmp_path).mkdir(parents=True)
    (CELL.folder(tmp_path) / "curve.csv").write_text(content)
    assert last_row(CELL, tmp_path, budget=200) == message


def test_a_copy_of_another_cell_is_never_taken_for_the_cell(tmp_path: Path) -> None:
    sweep(cells(1), tmp_path)
    shutil.copytree(CELL.folder(tmp_path), CELL.folder(tmp_path).with_name("seed-01"))
    code, text = sweep(cells(2), tmp_path)
    assert code == 1
    assert "failed  toy_reach/toy_search/default/seed-01" in text
    assert "is that of the cell toy_reach/toy_search/default/seed-00" in text


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


def test_a_process_that_is_killed_is_named_and_the_sweep_goes_on(tmp_path: Path) -> None:
    killed = cells(1, overrides=("evaluations=4", "die_at=50"))
    good = [Cell("toy_reach", "toy_search", seed=1, steps=100)]
    code, text = sweep([*killed, *good], tmp_path, jobs=1)
    assert code == 1
    assert "killed by SIGKILL" in str(stored(killed[0], tmp_path).failure)
    assert "killed by SIGKILL" in text
    assert stored(good[0], tmp_path).status == "done"


@pytest.mark.parametrize("damaged", [CHECKPOINT_FILE, "cell.json"])
def test_a_cell_with_a_damaged_file_fails_untouched_and_the_others_run(tmp_path: Path, damaged: str) -> None:
    open_folder(tmp_path)
    bad, good = cells(2)
    folder = bad.folder(tmp_path)
    folder.mkdir(parents=True)
    (folder / damaged).write_bytes(b"\x10\x00")
    code, text = sweep([bad, good], tmp_path)
    assert code == 1
    assert f"failed  {bad.name}  " in text
    assert damaged in text
    assert [path.name for path in folder.iterdir()] == [damaged]
    assert stored(good, tmp_path).status == "done"


def a_file_for_a_variant(cell: Cell, out: Path) -> None:
    cell.folder(out).parent.parent.mkdir(parents=True)
    cell.folder(out).parent.write_text("")


def a_file_for_a_cell(cell: Cell, out: Path) -> None:
    cell.folder(out).parent.mkdir(parents=True)
    cell.folder(out).write_text("")


def a_folder_for_a_lock(cell: Cell, out: Path) -> None:
    (cell.folder(out) / LOCK_FILE).mkdir(parents=True)


def a_folder_for_a_checkpoint(cell: Cell, out: Path) -> None:
    (cell.folder(out) / CHECKPOINT_FILE).mkdir(parents=True)


def a_folder_for_a_record(cell: Cell, out: Path) -> None:
    (cell.folder(out) / "cell.json").mkdir(parents=True)


def a_folder_for_a_curve(cell: Cell, out: Path) -> None:
    (cell.folder(out) / "curve.csv" / "in it").mkdir(parents=True)


@pytest.mark.parametrize(
    "obstacle",
    [
        a_file_for_a_variant,
        a_file_for_a_cell,
        a_folder_for_a_lock,
        a_folder_for_a_checkpoint,
        a_folder_for_a_record,
        a_folder_for_a_curve,
    ],
)
def test_a_cell_whose_folder_cannot_be_used_fails_with_the_reason_and_the_others_run(
    tmp_path: Path, obstacle: Callable[[Cell, Path], None]
) -> None:
    bad, good = cells(1)[0], Cell("toy_reach", "toy_search", 1, Variant.of(alpha=0.5), steps=100)
    open_folder(tmp_path)
    obstacle(bad, tmp_path)
    code, text = sweep([bad, good], tmp_path)
    assert code == 1
    (line,) = (line for line in text.splitlines() if line.startswith(f"failed  {bad.name}"))
    assert any(reason in line for reason in ("Not a directory", "Is a directory", "File exists", "it is a folder"))
    assert "Traceback" not in text
    assert stored(good, tmp_path).status == "done"


@pytest.mark.parametrize("harmless", [PROGRESS_FILE, LOG_FILE])
def test_a_file_on_which_nothing_depends_fails_no_cell(tmp_path: Path, harmless: str) -> None:
    (CELL.folder(tmp_path) / harmless / "in it").mkdir(parents=True)
    (tmp_path / MARKER_FILE).write_text("{}")
    assert sweep([CELL], tmp_path)[0] == 0
    assert stored(CELL, tmp_path).status == "done"


def test_what_a_kill_left_of_a_finished_cell_is_swept_by_the_next_sweep(tmp_path: Path) -> None:
    sweep([CELL], tmp_path)
    before = {path.name for path in CELL.folder(tmp_path).iterdir()}
    for name in (CHECKPOINT_FILE, PROGRESS_FILE, LOG_FILE, LOCK_FILE, ".cell.json-abc.partial"):
        (CELL.folder(tmp_path) / name).write_bytes(b"of a process that was killed as it ended")
    assert sweep([CELL], tmp_path)[0] == 0
    assert {path.name for path in CELL.folder(tmp_path).iterdir()} == before


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


def test_fewer_cells_run_at_a_time_if_more_do_not_fit_unless_they_are_asked_for() -> None:
    used, line = split_cores(8, cells=20, threads=1, jobs=None, fit=3)
    assert (used, "more would not fit in the memory" in line) == (3, True)
    assert split_cores(8, cells=20, threads=1, jobs=5, fit=3)[0] == 5
    assert split_cores(8, cells=2, threads=1, jobs=None, fit=3) == split_cores(8, cells=2, threads=1, jobs=None)
