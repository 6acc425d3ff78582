"""Kill a sweep at any moment: the same command resumes, and the curve is that of an undisturbed run."""

from __future__ import annotations

import contextlib
import itertools
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from codesign_bench import load_results
from codesign_bench.storage.layout import CHECKPOINT_FILE
from codesign_bench.storage.locks import is_locked
from codesign_bench.storage.records import CellRecord
from injected_faults import content
from toy import Gate

pytestmark = pytest.mark.usefixtures("toy", "every_batch")

STEPS = 1_500
ARGUMENTS = ("run", "--method", "toy_search", "--task", "toy_reach", "--set", "evaluations=6")
SLOW = ("delay=0.01",)
"""Batches that last, so that a kill lands in the middle of one."""
PATIENCE_SECONDS = 120.0
KILLING_SECONDS = 600.0
SEED_FOLDER = Path("toy_reach/toy_search/default/seed-00")


def wait_for(condition: Callable[[], bool]) -> None:
    """Wait until `condition()` holds; it always does in the end, unless something is broken."""
    deadline = time.monotonic() + PATIENCE_SECONDS
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
    wait_for(lambda: not any(map(is_locked, cell_folders(out))))


def cell_folders(out: Path) -> list[Path]:
    return [path.parent for path in out.glob("*/*/*/*/cell.json")]


def curve(out: Path) -> pd.DataFrame:
    return load_results(out).drop(columns="wall_s")


def kill_repeatedly(out: Path, kills: int, arguments: tuple[str, ...], gate: Gate, steps: int = STEPS) -> None:
    """Kill a sweep `kills` times, each time at a random moment after a new checkpoint and before its end."""
    moments = random.Random(1)
    for count in range(1, kills + 1):
        gate.close_at(steps * count // (kills + 1))
        before = _changed(out / SEED_FOLDER)
        process = start(*arguments, "--steps", str(steps), "--out", out)
        wait_for(lambda: _changed(out / SEED_FOLDER) != before)  # noqa: B023  # used in this turn
        time.sleep(moments.uniform(0.0, 0.4))
        assert process.poll() is None, process.communicate()
        kill_and_wait(process, out)
    gate.open()


def _changed(folder: Path) -> float:
    try:
        return (folder / CHECKPOINT_FILE).stat().st_mtime
    except FileNotFoundError:
        return 0.0


def compare_killed_with_undisturbed(
    tmp_path: Path, kills: int, arguments: tuple[str, ...], gate: Gate, steps: int = STEPS
) -> None:
    kill_repeatedly(tmp_path / "killed", kills, arguments, gate, steps)
    for name in ("killed", "undisturbed"):
        code, text = finish(start(*arguments, "--steps", str(steps), "--out", tmp_path / name))
        assert code == 0, text
    pd.testing.assert_frame_equal(curve(tmp_path / "killed"), curve(tmp_path / "undisturbed"), check_exact=True)
    for name in ("metrics.csv", "evaluation.csv", "policy.safetensors"):
        files = [tmp_path / run / SEED_FOLDER / name for run in ("killed", "undisturbed")]
        assert files[0].read_bytes() == files[1].read_bytes()


def test_two_kills_lose_nothing(tmp_path: Path, gate: Gate) -> None:
    compare_killed_with_undisturbed(tmp_path, 2, (*ARGUMENTS, *SLOW), gate)


@pytest.mark.slow
def test_twenty_kills_lose_nothing(tmp_path: Path, gate: Gate) -> None:
    compare_killed_with_undisturbed(tmp_path, 20, (*ARGUMENTS, *SLOW, "--seeds", "2"), gate, steps=12_000)


@pytest.mark.slow
def test_ten_minutes_of_random_kills_lose_nothing(tmp_path: Path) -> None:
    moments, kills, arguments = random.Random(2), 0, (*ARGUMENTS, *SLOW, "--seeds", "2", "--retry-failed")
    ends_at = time.monotonic() + KILLING_SECONDS
    wanted = finished(tmp_path / "undisturbed", arguments)
    for turn in itertools.count():
        out = tmp_path / str(turn)
        while (process := start(*arguments, "--steps", str(STEPS), "--out", out)).poll() is None:
            time.sleep(moments.uniform(0.0, 6.0))
            running = [folder for folder in cell_folders(out) if is_locked(folder)]
            victims = [process.pid, *(record.pid for folder in running if (record := CellRecord.read(folder)))]
            with contextlib.suppress(ProcessLookupError):
                os.kill(moments.choice([victim for victim in victims if victim]), signal.SIGKILL)
                kills += 1
            if finish(process)[0] == 0:
                break
            wait_for(lambda: not any(map(is_locked, cell_folders(out))))  # noqa: B023  # used in this turn
        assert finished(out, arguments) == wanted
        if time.monotonic() > ends_at:
            break
    assert kills > 20


def finished(out: Path, arguments: tuple[str, ...]) -> dict[str, bytes]:
    """Run a sweep to its end; return what all undisturbed sweeps have in common."""
    code, text = finish(start(*arguments, "--steps", str(STEPS), "--out", out))
    assert code == 0, text
    return content(out)


def test_wall_time_goes_on_from_the_interruption(tmp_path: Path, gate: Gate) -> None:
    arguments = (*ARGUMENTS, "delay=0.03")
    kill_repeatedly(tmp_path, 1, arguments, gate)
    code, text = finish(start(*arguments, "--steps", str(STEPS), "--out", tmp_path))
    assert code == 0, text
    frame = load_results(tmp_path)
    assert frame["wall_s"].is_monotonic_increasing
    record = CellRecord.read(tmp_path / SEED_FOLDER)
    assert record is not None
    batches = len(pd.read_csv(tmp_path / SEED_FOLDER / "metrics.csv"))
    assert float(record.timings.wall_s or 0.0) >= float(record.timings.train_s or 0.0) >= batches * 0.03


def interruptible(out: Path, gate: Gate) -> subprocess.Popen[str]:
    """Start a sweep of two cells that does not end while the gate is closed; wait until one has been saved."""
    gate.close_at(STEPS // 2)
    process = start(*ARGUMENTS, *SLOW, "--steps", str(STEPS), "--seeds", "2", "--out", out)
    wait_for(lambda: any(out.glob(f"*/*/*/*/{CHECKPOINT_FILE}")))
    return process


def test_ctrl_c_says_how_to_go_on_and_leaves_no_process(tmp_path: Path, gate: Gate) -> None:
    process = interruptible(tmp_path, gate)
    process.send_signal(signal.SIGINT)
    code, text = finish(process)
    assert code == 130
    assert text.strip().splitlines()[-1] == "interrupted; the same command resumes"
    assert "Traceback" not in text
    wait_for(lambda: not any(map(is_locked, cell_folders(tmp_path))))
    assert "interrupted" in finish(start("status", "--results", tmp_path))[1]


def test_a_killed_worker_does_not_end_the_sweep(tmp_path: Path, gate: Gate) -> None:
    if len(os.sched_getaffinity(0)) < 2:
        pytest.skip("one core means no joblib workers")
    process = interruptible(tmp_path, gate)
    record = CellRecord.read(next(tmp_path.glob(f"*/*/*/*/{CHECKPOINT_FILE}")).parent)
    assert record is not None
    assert record.pid is not None
    os.kill(parent_of(record.pid), signal.SIGKILL)
    gate.open()
    code, text = finish(process)
    assert code == 0, text
    assert "a worker process died" in text
    assert len(load_results(tmp_path)["seed"].unique()) == 2


def test_two_sweeps_on_one_folder_share_the_work(tmp_path: Path) -> None:
    arguments = (*ARGUMENTS, *SLOW, "--steps", "300", "--seeds", "2", "--jobs", "1", "--out", str(tmp_path))
    sweeps = [start(*arguments) for _ in range(2)]
    for code, text in map(finish, sweeps):
        assert code == 0, text
        assert "all 2 cells done" in text
    frame = load_results(tmp_path)
    assert not frame.duplicated(["seed", "env_steps"]).any()
    assert frame.groupby("seed")["env_steps"].max().ge(300).all()


def test_a_sweep_goes_on_when_nobody_reads_its_output(tmp_path: Path, gate: Gate) -> None:
    process = interruptible(tmp_path, gate)
    assert process.stdout is not None
    process.stdout.close()
    gate.open()
    assert process.wait(timeout=PATIENCE_SECONDS) == 0
    assert process.stderr is not None
    assert process.stderr.read() == ""
    assert len(load_results(tmp_path)["seed"].unique()) == 2


def test_a_sweep_goes_on_when_the_disk_behind_its_output_is_full(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "codesign_bench", *ARGUMENTS, "--steps", "200", "--out", str(tmp_path)]
    with open("/dev/full", "w") as full:
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, timeout=PATIENCE_SECONDS)
    assert done.returncode == 0, done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert "No space left on device" in done.stderr
    assert len(load_results(tmp_path)["seed"].unique()) == 1


def test_sigterm_reads_as_stopped_and_the_same_command_resumes(tmp_path: Path, gate: Gate) -> None:
    process = interruptible(tmp_path, gate)
    process.terminate()
    assert finish(process)[0] == 130
    wait_for(lambda: not any(map(is_locked, cell_folders(tmp_path))))
    counts = finish(start("status", "--results", tmp_path))[1].splitlines()[-1]
    assert "interrupted" in counts
    assert "done" not in counts


def test_a_cell_that_somebody_stops_is_interrupted_and_not_failed(tmp_path: Path, gate: Gate) -> None:
    process = interruptible(tmp_path, gate)
    folder = next(tmp_path.glob(f"*/*/*/*/{CHECKPOINT_FILE}")).parent
    record = CellRecord.read(folder)
    assert record is not None
    os.kill(int(record.pid or 0), signal.SIGTERM)
    gate.open()
    code, text = finish(process)
    assert code == 1
    assert "killed by SIGTERM" in text
    assert "1 of 2 cells interrupted; the same command resumes them" in text
    stopped = CellRecord.read(folder)
    assert stopped is not None
    assert stopped.status == "running", "which reads as interrupted where no process holds the lock"
    assert finish(start(*ARGUMENTS, *SLOW, "--steps", str(STEPS), "--seeds", "2", "--out", tmp_path))[0] == 0


def test_a_deleted_working_folder_stops_nothing_that_has_absolute_paths(tmp_path: Path) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    line = "import os, sys; os.rmdir(os.getcwd()); os.execv(sys.executable, [sys.executable, '-m', *sys.argv[1:]])"
    words = [sys.executable, "-c", line, "codesign_bench", *ARGUMENTS, "--steps", "200"]
    for out, code, told in ((str(tmp_path / "runs"), 0, ""), ("runs", 2, "the working folder was deleted")):
        gone.mkdir(exist_ok=True)
        done = subprocess.run(
            [*words, "--out", out], cwd=gone, capture_output=True, text=True, timeout=PATIENCE_SECONDS
        )
        assert (done.returncode, told in done.stderr) == (code, True), done.stdout + done.stderr
        assert len(done.stderr.splitlines()) <= 1
