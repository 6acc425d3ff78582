"""A worker runs a cell in a process of its own and tells how it ended."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from builders import toy_cells
from codesign_bench.cell.cell import Cell
from codesign_bench.registry import IMPORTS_VARIABLE
from codesign_bench.storage.layout import LOG_FILE, PROGRESS_FILE
from codesign_bench.storage.locks import locked
from codesign_bench.storage.records import CellRecord
from codesign_bench.sweep.workers import Job, Outcome, describe_exit, prepare_worker, run_job

pytestmark = pytest.mark.usefixtures("toy")


def toy_cell(*settings: str, steps: int = 40) -> Cell:
    """Return a toy cell that takes a few batches, with these settings."""
    return toy_cells(steps=steps, overrides=("evaluations=1", *settings))[0]


def run(cell: Cell, out: Path, *, retry: bool = False, imported: str = "toy") -> Outcome:
    """Run a cell's job."""
    return run_job(Job(cell, str(out), retry, imported))


def test_a_cell_is_run_once_and_then_done(tmp_path: Path) -> None:
    cell = toy_cell()
    assert run(cell, tmp_path) == Outcome(cell, "done")
    before = (cell.folder(tmp_path) / "cell.json").read_bytes()
    (cell.folder(tmp_path) / PROGRESS_FILE).write_text("of an earlier run")
    assert run(cell, tmp_path) == Outcome(cell, "done")
    assert (cell.folder(tmp_path) / "cell.json").read_bytes() == before
    assert not (cell.folder(tmp_path) / PROGRESS_FILE).exists()


def test_a_cell_that_somebody_else_runs_is_left_alone(tmp_path: Path) -> None:
    cell = toy_cell()
    folder = cell.folder(tmp_path)
    folder.mkdir(parents=True)
    with locked(folder):
        assert run(cell, tmp_path) == Outcome(cell, "busy")
    assert not (folder / "cell.json").exists()


def test_a_failure_is_told_in_a_line_and_run_again_only_when_asked(tmp_path: Path) -> None:
    cell = toy_cell("fail_at=0")
    failed = Outcome(cell, "failed", "RuntimeError: the toy broke")
    assert run(cell, tmp_path) == failed
    path = cell.folder(tmp_path) / "cell.json"
    before = path.read_bytes()
    assert run(cell, tmp_path) == failed
    assert path.read_bytes() == before
    assert run(cell, tmp_path, retry=True) == failed
    assert path.read_bytes() != before


def test_a_cell_of_another_configuration_is_refused_with_the_difference(tmp_path: Path) -> None:
    run(toy_cell(), tmp_path)
    path = toy_cell().folder(tmp_path) / "cell.json"
    path.write_text(path.read_text().replace('"done"', '"running"'))
    other = toy_cell("episodes=5")
    assert run(other, tmp_path) == Outcome(
        other, "failed", "the stored configuration differs: episodes: stored 4, requested 5"
    )


def test_a_killed_process_is_recorded_as_a_failure(tmp_path: Path) -> None:
    cell = toy_cell("die_at=0")
    outcome = run(cell, tmp_path)
    assert (outcome.status, outcome.message) == ("failed", describe_exit(-signal.SIGKILL))
    record = CellRecord.read(cell.folder(tmp_path))
    assert record is not None
    assert record.failure is not None
    assert (record.status, record.failure.message) == ("failed", outcome.message)


def test_a_cell_that_is_refused_before_its_record_is_told_in_a_line(tmp_path: Path) -> None:
    outcome = run(toy_cell(), tmp_path, imported="")
    assert outcome.status == "failed"
    assert outcome.message.startswith("unknown method 'toy_search'; choose from: ")
    assert "unknown method 'toy_search'" in (outcome.cell.folder(tmp_path) / LOG_FILE).read_text()


def test_a_process_that_dies_before_its_record_is_told_by_its_last_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "dies.py").write_text("import os\nos.write(2, b'one line\\nthe reason\\n')\nos._exit(3)\n")
    monkeypatch.syspath_prepend(tmp_path)
    outcome = run(toy_cell(), tmp_path / "runs", imported="dies")
    log = outcome.cell.folder(tmp_path / "runs") / LOG_FILE
    assert outcome.status == "failed"
    assert outcome.message == f"{describe_exit(3)}: the reason (all in {log})"
    assert log.read_text() == "one line\nthe reason\n"


@pytest.mark.parametrize(
    ("code", "told"),
    [
        (3, "the cell's process ended with exit code 3 and recorded nothing"),
        (-signal.SIGTERM, "the cell's process was killed by SIGTERM"),
        (-signal.SIGKILL, "the cell's process was killed by SIGKILL; the system may be out of memory"),
        (-250, "the cell's process was killed by signal 250"),
    ],
)
def test_how_a_process_ended_is_said_in_words(code: int, told: str) -> None:
    assert describe_exit(code) == told


def test_a_worker_passes_over_ctrl_c_and_the_main_process_does_not() -> None:
    before = signal.getsignal(signal.SIGINT)
    prepare_worker(os.getpid())
    assert signal.getsignal(signal.SIGINT) is before
    line = (
        "import os, signal; from codesign_bench.sweep.workers import prepare_worker; "
        "prepare_worker(os.getppid()); os.kill(os.getpid(), signal.SIGINT); print('still here')"
    )
    done = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "still here\n")


def test_modules_of_the_command_line_reach_the_process_whatever_this_ones_environment_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(IMPORTS_VARIABLE, "no_such_module")
    assert run(toy_cell(), tmp_path).status == "done"
