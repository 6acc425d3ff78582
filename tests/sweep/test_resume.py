"""Kill a sweep at any moment: the same command resumes, and the curve is that of an undisturbed run."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest

from codesign_bench import load_results
from codesign_bench.storage.layout import CHECKPOINT_FILE, is_locked
from codesign_bench.storage.records import CellRecord

pytestmark = pytest.mark.usefixtures("toy", "every_batch")

# Slow batches, so that a kill lands in the middle; seconds are no part of what is compared.
ARGUMENTS = ("run", "--method", "toy_search", "--task", "toy_reach", "--steps", "1500", "--set", "evaluations=6")
SLOW = ("delay=0.03",)
PATIENCE_SECONDS = 120.0
SEED_FOLDER = Path("toy_reach/toy_search/default/seed-00")


def wait_for(condition: object, seconds: float = PATIENCE_SECONDS) -> None:
    """Wait until `condition()` holds."""
    assert callable(condition)
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)


def start(*arguments: str | Path) -> subprocess.Popen[str]:
    """Start `codesign-bench` as a process of its own, which hears Ctrl-C even where the tests run in the background."""
    words = [sys.executable, "-m", "codesign_bench", *map(str, arguments)]
    return subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=hear_interrupts
    )


def hear_interrupts() -> None:
    """Undo what a shell does to the processes that it starts in the background: it has them ignore Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def parent_of(pid: int) -> int:
    return int(subprocess.run(["ps", "-o", "ppid=", "-p", str(pid)], check=True, capture_output=True).stdout)


def finish(process: subprocess.Popen[str]) -> tuple[int, str]:
    """Wait for a process; return its exit code and all its output."""
    output, errors = process.communicate(timeout=PATIENCE_SECONDS)
    return process.returncode, output + errors


def kill_and_wait(process: subprocess.Popen[str], out: Path) -> None:
    """Kill the main process alone, and wait until no cell is left running: its process gives up its lock."""
    process.kill()
    process.communicate(timeout=PATIENCE_SECONDS)
    wait_for(lambda: not any(map(is_locked, cell_folders(out))), seconds=10.0)


def cell_folders(out: Path) -> list[Path]:
    return [path.parent for path in out.glob("*/*/*/*/cell.json")]


def curve(out: Path) -> pd.DataFrame:
    return load_results(out).drop(columns="wall_s")


def kill_repeatedly(out: Path, kills: int, arguments: tuple[str, ...]) -> int:
    """Kill a sweep `kills` times at random moments after its first checkpoint, or until it ends; return the kills."""
    moments = random.Random(1)
    for count in range(kills):
        process = start(*arguments, "--out", out)
        folder = out / SEED_FOLDER
        before = _changed(folder)
        wait_for(lambda: process.poll() is not None or _changed(folder) != before)  # noqa: B023  # used in this turn
        time.sleep(moments.uniform(0.0, 0.4))
        if process.poll() is not None:
            process.communicate()
            return count
        kill_and_wait(process, out)
    return kills


def _changed(folder: Path) -> float:
    try:
        return (folder / CHECKPOINT_FILE).stat().st_mtime
    except FileNotFoundError:
        return 0.0


def compare_killed_with_undisturbed(tmp_path: Path, kills: int, arguments: tuple[str, ...]) -> None:
    killed = kill_repeatedly(tmp_path / "killed", kills, arguments)
    assert killed == kills, "the sweep ended before it was killed often enough"
    assert finish(start(*arguments, "--out", tmp_path / "killed"))[0] == 0
    assert finish(start(*arguments, "--out", tmp_path / "undisturbed"))[0] == 0
    pd.testing.assert_frame_equal(curve(tmp_path / "killed"), curve(tmp_path / "undisturbed"), check_exact=True)
    for name in ("metrics.csv", "evaluation.csv", "policy.safetensors"):
        files = [tmp_path / run / SEED_FOLDER / name for run in ("killed", "undisturbed")]
        assert files[0].read_bytes() == files[1].read_bytes()


def test_two_kills_lose_nothing(tmp_path: Path) -> None:
    compare_killed_with_undisturbed(tmp_path, 2, (*ARGUMENTS, *SLOW))


@pytest.mark.slow
def test_twenty_kills_lose_nothing(tmp_path: Path) -> None:
    arguments = (*ARGUMENTS[:6], "12000", *ARGUMENTS[7:], "delay=0.02")
    compare_killed_with_undisturbed(tmp_path, 20, (*arguments, "--seeds", "2"))


def test_wall_time_goes_on_from_the_interruption(tmp_path: Path) -> None:
    kill_repeatedly(tmp_path, 1, (*ARGUMENTS, *SLOW))
    assert finish(start(*ARGUMENTS, *SLOW, "--out", tmp_path))[0] == 0
    frame = load_results(tmp_path)
    assert frame["wall_s"].is_monotonic_increasing
    record = CellRecord.read(tmp_path / SEED_FOLDER)
    assert record is not None
    assert float(record.timings.wall_s or 0.0) >= float(record.timings.train_s or 0.0) > 1.0


def test_ctrl_c_says_how_to_go_on_and_leaves_no_process(tmp_path: Path) -> None:
    process = start(*ARGUMENTS, "delay=0.2", "--seeds", "2", "--out", tmp_path)
    wait_for(lambda: len(list(tmp_path.glob(f"*/*/*/*/{CHECKPOINT_FILE}"))) >= 1 or process.poll() is not None)
    process.send_signal(signal.SIGINT)
    code, text = finish(process)
    assert code == 130
    assert text.strip().splitlines()[-1] == "interrupted; the same command resumes"
    assert "Traceback" not in text
    wait_for(lambda: not any(map(is_locked, cell_folders(tmp_path))), seconds=10.0)
    assert "interrupted" in finish(start("status", "--results", tmp_path))[1]


def test_a_killed_worker_does_not_end_the_sweep(tmp_path: Path) -> None:
    if len(os.sched_getaffinity(0)) < 2:
        pytest.skip("one core means no joblib workers")
    process = start(*ARGUMENTS, "delay=0.05", "--seeds", "2", "--out", tmp_path)
    wait_for(lambda: len(list(tmp_path.glob(f"*/*/*/*/{CHECKPOINT_FILE}"))) >= 1 or process.poll() is not None)
    record = CellRecord.read(next(tmp_path.glob(f"*/*/*/*/{CHECKPOINT_FILE}")).parent)
    assert record is not None
    assert record.pid is not None
    os.kill(parent_of(record.pid), signal.SIGKILL)
    code, text = finish(process)
    assert code == 0, text
    assert "a worker process died" in text
    assert len(load_results(tmp_path)["seed"].unique()) == 2


def test_two_sweeps_on_one_folder_share_the_work(tmp_path: Path) -> None:
    arguments = (*ARGUMENTS[:6], "300", *ARGUMENTS[7:], *SLOW, "--seeds", "2", "--jobs", "1", "--out", str(tmp_path))
    sweeps = [start(*arguments) for _ in range(2)]
    for code, text in map(finish, sweeps):
        assert code == 0, text
        assert "all 2 cells done" in text
    frame = load_results(tmp_path)
    assert not frame.duplicated(["seed", "env_steps"]).any()
    assert frame.groupby("seed")["env_steps"].max().ge(300).all()
