"""A sweep on a Dask cluster gives what a sweep here gives, and goes on when a worker is killed."""

from __future__ import annotations

import io
import os
import signal
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

distributed: Any = pytest.importorskip("distributed")

pytestmark = pytest.mark.usefixtures("toy", "every_batch")


@pytest.fixture
def cluster(toy: None) -> Iterator[Any]:
    """Two workers on this machine; their environment is that of the test."""
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as running:
        yield running


def cells(delay: float = 0.0, fail: bool = False) -> list[Cell]:
    """Return four toy cells; each batch of about twenty takes `delay` seconds, and the last cell may fail."""
    overrides = ("evaluations=4", f"delay={delay}", *(("fail_at=100",) if fail else ()))
    return list(grid(tasks=["toy_reach"], methods=["toy_search"], seeds=range(4), steps=400, overrides=overrides))


def sweep(wanted: list[Cell], out: Path, **options: Any) -> tuple[int, str]:
    """Run a sweep; return its exit code and what it printed."""
    console = Console(record=True, width=200, file=io.StringIO())
    code = run_sweep(resolve_cells(wanted), out, console=console, **options)
    return code, console.export_text()


def curves(out: Path) -> Any:
    """Return all curves without what a clock decides."""
    return load_results(out).drop(columns="wall_s")


def test_a_killed_worker_costs_no_cell_and_changes_no_curve(cluster: Any, tmp_path: Path) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    assert sweep(cells(delay=0.05), here)[0] == 0

    def kill_a_worker() -> None:
        while len(list(there.glob(f"*/*/*/*/{PROGRESS_FILE}"))) < 2:
            time.sleep(0.05)
        with distributed.Client(cluster.scheduler_address, set_as_default=False) as client:
            os.kill(next(iter(client.run(os.getpid).values())), signal.SIGKILL)
        killed.set()

    killed = threading.Event()
    killer = threading.Thread(target=kill_a_worker, daemon=True)
    killer.start()
    code, text = sweep(cells(delay=0.05), there, backend="dask", scheduler=cluster.scheduler_address)
    killer.join(timeout=10.0)
    assert killed.is_set()
    assert code == 0, text
    assert curves(here).equals(curves(there))
    code, text = sweep(cells(delay=0.05), there, backend="dask", scheduler=cluster.scheduler_address)
    assert (code, "4 of them already done" in text) == (0, True)


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
    assert "--scheduler tcp://127.0.0.1:9" in capsys.readouterr().err
