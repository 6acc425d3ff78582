"""A sweep on a Dask cluster gives what a sweep here gives, and goes on when a worker is killed."""

from __future__ import annotations

import io
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from codesign_bench import load_results
from codesign_bench.cell.cell import Cell, resolve_cells
from codesign_bench.cell.grid import grid
from codesign_bench.cli import main
from codesign_bench.errors import UserError
from codesign_bench.storage.layout import PROGRESS_FILE
from codesign_bench.sweep.runner import run_sweep
from toy import Gate

distributed: Any = pytest.importorskip("distributed")

pytestmark = pytest.mark.usefixtures("toy", "every_batch")


@pytest.fixture
def cluster(gate: Gate) -> Iterator[Any]:
    """Two workers on this machine; their environment is that of the test."""
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as running:
        yield running


def cells(fail: bool = False) -> list[Cell]:
    """Return four toy cells of about twenty batches, which may fail."""
    overrides = ("evaluations=4", *(("fail_at=100",) if fail else ()))
    return list(grid(tasks=["toy_reach"], methods=["toy_search"], seeds=range(4), steps=400, overrides=overrides))


def sweep(wanted: list[Cell], out: Path, **options: Any) -> tuple[int, str]:
    """Run a sweep; return its exit code and what it printed."""
    console = Console(record=True, width=200, file=io.StringIO())
    code = run_sweep(resolve_cells(wanted), out, console=console, **options)
    return code, console.export_text()


def curves(out: Path) -> Any:
    """Return all curves without what a clock decides."""
    return load_results(out).drop(columns="wall_s")


def test_a_killed_worker_costs_no_cell_and_changes_no_curve(cluster: Any, gate: Gate, tmp_path: Path) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    assert sweep(cells(), here)[0] == 0

    def kill_a_worker() -> None:
        try:
            while len(list(there.glob(f"*/*/*/*/{PROGRESS_FILE}"))) < 2 and time.monotonic() < deadline:
                time.sleep(0.05)
            with distributed.Client(cluster.scheduler_address, set_as_default=False) as client:
                workers = client.run(os.getpid)
            os.kill(next(iter(workers.values())), signal.SIGKILL)
            killed.set()
        finally:
            gate.open()

    killed = threading.Event()
    deadline = time.monotonic() + 120.0
    gate.close_at(200)  # Both workers have a cell that is not done when one of them is killed.
    killer = threading.Thread(target=kill_a_worker, daemon=True)
    killer.start()
    code, text = sweep(cells(), there, backend="dask", scheduler=cluster.scheduler_address)
    killer.join()
    assert killed.is_set()
    assert code == 0, text
    assert curves(here).equals(curves(there))
    code, text = sweep(cells(), there, backend="dask", scheduler=cluster.scheduler_address)
    assert (code, "4 of them already done" in text) == (0, True)


def test_a_single_worker_does_the_work_and_not_the_main_process(
    gate: Gate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(job: object) -> None:
        raise AssertionError("the main process runs a cell")

    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as running:
        monkeypatch.setattr("codesign_bench.sweep.workers._run_process", refuse)
        code, text = sweep(cells()[:1], tmp_path, backend="dask", scheduler=running.scheduler_address)
    assert code == 0, text


@pytest.fixture
def scheduler(gate: Gate, tmp_path: Path) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A scheduler in a process of its own, with its address."""
    where = tmp_path / "scheduler.json"
    words = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    process = subprocess.Popen(
        [*words, "--no-dashboard", "--scheduler-file", str(where)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        deadline = time.monotonic() + 120.0
        while not (where.exists() and where.read_text().endswith("}")):
            assert time.monotonic() < deadline, "waited in vain"
            time.sleep(0.05)
        yield json.loads(where.read_text())["address"], process
    finally:
        process.kill()
        process.wait()


def test_a_scheduler_without_workers_gets_one_line(
    scheduler: tuple[str, subprocess.Popen[bytes]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    address, _ = scheduler
    monkeypatch.setattr("codesign_bench.sweep.backends.WORKER_SECONDS", 0.5)
    with pytest.raises(UserError, match=f"--scheduler {address}: it has no worker; start one with: dask worker"):
        sweep(cells()[:1], tmp_path / "runs", backend="dask", scheduler=address)


@pytest.mark.slow
def test_a_scheduler_that_is_killed_leaves_cells_interrupted_and_the_same_command_resumes(
    scheduler: tuple[str, subprocess.Popen[bytes]], gate: Gate, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    address, process = scheduler
    out = tmp_path / "runs"
    words = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard"]
    worker = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def kill_the_scheduler() -> None:
        while not list(out.glob(f"*/*/*/*/{PROGRESS_FILE}")):
            time.sleep(0.05)
        process.kill()

    gate.close_at(200)
    killer = threading.Thread(target=kill_the_scheduler, daemon=True)
    killer.start()
    try:
        code, text = sweep(cells()[:2], out, backend="dask", scheduler=address)
    finally:
        worker.terminate()
        worker.wait()
    killer.join()
    assert code == 1
    assert f"the Dask scheduler {address} has gone" in text
    assert "2 of 2 cells interrupted; the same command resumes them" in text
    assert "Traceback" not in text + "".join(capfd.readouterr())
    gate.open()
    assert sweep(cells()[:2], out)[0] == 0


def test_failures_are_recorded_as_elsewhere(cluster: Any, tmp_path: Path) -> None:
    code, text = sweep(cells(fail=True)[:2], tmp_path, backend="dask", scheduler=cluster.scheduler_address)
    assert code == 1
    assert "2 of 2 cells failed" in text


def test_without_a_scheduler_a_cluster_starts_and_ends_with_the_sweep(tmp_path: Path) -> None:
    code, text = sweep(cells()[:2], tmp_path, backend="dask", jobs=1)
    assert code == 0, text
    with pytest.raises(ValueError, match="client"):
        distributed.get_client()


def test_a_scheduler_that_does_not_answer_gets_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("codesign_bench.sweep.backends.CONNECT_SECONDS", 0.5)
    with pytest.raises(UserError, match="no Dask scheduler answers"):
        sweep(cells()[:1], tmp_path, backend="dask", scheduler="tcp://127.0.0.1:9")
    arguments = ["--method", "toy_search", "--task", "toy_reach", "--import", "toy", "--out", str(tmp_path)]
    assert main(["run", *arguments, "--backend", "dask", "--scheduler", "tcp://127.0.0.1:9"]) == 2
    assert list(tmp_path.iterdir()) == [], "a refused command leaves nothing behind"
    assert "--scheduler tcp://127.0.0.1:9" in capsys.readouterr().err
