"""`codesign-bench status` tells what a results folder holds, and why cells failed."""

from __future__ import annotations

import io
import json
from pathlib import Path

import pytest
from rich.console import Console

from builders import store_cell
from codesign_bench.cli import main
from codesign_bench.cli.status import IDLE_SECONDS, watch
from codesign_bench.storage.locks import locked
from codesign_bench.storage.records import FAILED, RUNNING, Failure


def test_status_tells_why_a_cell_failed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    failure = Failure("the toy broke", "Traceback\nRuntimeError: the toy broke\n")
    store_cell(tmp_path, status=FAILED, failure=failure)
    assert main(["status", "--results", str(tmp_path)]) == 0
    assert capsys.readouterr().out.splitlines()[-1].endswith("RuntimeError: the toy broke")


def test_status_names_what_cannot_be_used_and_lists_the_rest(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for seed in range(3):
        store_cell(tmp_path, seed=seed)
    cells = tmp_path / "push" / "gnn_ppo" / "default"
    (cells / "seed-01" / "cell.json").write_text("{")
    (cells / "seed-02" / "curve.csv").unlink()
    assert main(["status", "--results", str(tmp_path)]) == 0
    printed = capsys.readouterr()
    assert printed.out.splitlines()[-1] == "2 cells: 1 damaged, 1 done"
    assert [line.split(": ")[1] for line in printed.err.splitlines()] == [
        "push/gnn_ppo/default/seed-01/cell.json",
        "push/gnn_ppo/default/seed-02/curve.csv",
    ]


def test_errors_of_cells_control_no_terminal(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    store_cell(tmp_path, status=FAILED, failure=Failure("\x1b[2J", "\x1b]0;mine\x07"))
    assert main(["status", "--results", str(tmp_path)]) == 0
    assert capsys.readouterr().out.splitlines()[-1].endswith(r": \x1b]0;mine\x07")


def test_for_programs_every_cell_is_an_event(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    store_cell(tmp_path, curve=[{"env_steps": 900, "return_mean": 1.5}])
    store_cell(tmp_path, seed=1, status=FAILED, failure=Failure("broke", "Traceback\nRuntimeError: broke\n"))
    assert main(["status", "--json", "--results", str(tmp_path)]) == 0
    first, second, counts = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert (first["cell"], first["status"]) == ("push/gnn_ppo/default/seed-00", "done")
    assert (first["env_steps"], first["steps"], first["return_mean"]) == (900, 1000, 1.5)
    assert second["failure"] == "RuntimeError: broke"
    assert (counts["cells"], counts["done"], counts["failed"]) == (2, 1, 1)


def test_watching_goes_on_while_a_cell_runs_and_ends_some_time_after(tmp_path: Path) -> None:
    folder = store_cell(tmp_path, status=RUNNING)
    console, lock, pauses = Console(record=True, width=200, file=io.StringIO()), locked(folder), list[float]()

    def pause(seconds: float) -> None:
        pauses.append(seconds)
        if len(pauses) == 10:
            lock.__exit__(None, None, None)

    lock.__enter__()
    watch(console, tmp_path, IDLE_SECONDS / 3, pause)
    lines = console.export_text().splitlines()
    assert sum("1 cells: 1 running" in line for line in lines) == 10
    assert sum("1 cells: 1 interrupted" in line for line in lines) == 4
    assert lines[-1] == f"no cell has been running for {IDLE_SECONDS:.0f} s"


def test_ctrl_c_ends_watching_in_order(tmp_path: Path) -> None:
    def interrupt(seconds: float) -> None:
        raise KeyboardInterrupt

    store_cell(tmp_path)
    watch(Console(file=io.StringIO()), tmp_path, 1.0, interrupt)
    assert main(["status", "--watch", "--results", str(tmp_path / "nowhere")]) == 2
