"""The program: what every command promises of its output, its exit code and bad input."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from codesign_bench.cli import main

pytestmark = pytest.mark.usefixtures("toy")

RUN = ("run", "--method", "toy_search", "--task", "toy_reach", "--steps", "100", "--set", "evaluations=2")


def test_run_status_and_plot(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    results, figures = tmp_path / "runs", tmp_path / "figures"
    assert main([*RUN, "--seeds", "2", "--out", str(results)]) == 0
    assert "all 2 cells done" in capsys.readouterr().out
    assert main(["status", "--results", str(results)]) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[1].split()[:2] == ["toy_reach/toy_search/default/seed-00", "done"]
    assert told[-1] == "2 cells: 2 done"
    assert main(["plot", "learning_curves", "--results", str(results), "--out", str(figures)]) == 0
    picture = capsys.readouterr().out.splitlines()[-1]
    assert picture == str(figures / "learning_curves.png")
    assert {path.name for path in figures.iterdir()} == {f"learning_curves.{kind}" for kind in ("png", "pdf", "csv")}


def test_a_pipe_gets_plain_lines_although_a_notebook_wants_colours(tmp_path: Path) -> None:
    line = [sys.executable, "-m", "codesign_bench", *RUN, "--import", "toy", "--seeds", "1", "--out", str(tmp_path)]
    wanting = {**os.environ, "FORCE_COLOR": "1", "PYTHONPATH": str(Path(__file__).resolve().parents[1])}
    done = subprocess.run(line, capture_output=True, text=True, env=wanting, check=True)
    assert done.stdout.splitlines()[-1] == "all 1 cells done"
    assert "\x1b" not in done.stdout


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ([], "COMMAND"),
        (["fly"], "fly"),
        (["run", "--method", "gnn", "--task", "toy_reach"], "gnn_ppo"),
        (["run", "--method", "toy_search", "--task", "pull"], "toy_reach"),
        (["run", "--method", ",", "--task", "toy_reach"], "--method"),
        (["run", "--task", "toy_reach"], "--method"),
        ([*RUN, "--profile", "fast"], "quick, laptop, workstation, paper"),
        ([*RUN, "speed=1"], "episodes"),
        ([*RUN, "episodes=few"], "expected an integer"),
        ([*RUN, "threads=4096"], "cores"),
        ([*RUN, "--seeds", "0"], "--seeds"),
        ([*RUN, "--seeds", "-1"], "--seeds"),
        ([*RUN, "--seeds=-2,1"], "--seeds"),
        ([*RUN, "--steps", "0"], "--steps"),
        ([*RUN, "--steps", "-5"], "--steps"),
        ([*RUN, "--steps", "many"], "--steps"),
        ([*RUN, "--jobs", "0"], "--jobs"),
        ([*RUN, "--cutout", "1.5"], "--cutout"),
        ([*RUN, "--alpha", "-0.5"], "--alpha"),
        ([*RUN, "--alpha", "nan"], "--alpha"),
        ([*RUN, "--device", "cuda"], "--device"),
        ([*RUN, "--set", "device=cuda"], "--device"),
        ([*RUN, "--device", "abacus"], "cuda"),
        ([*RUN, "--scheduler", "tcp://localhost:1"], "--scheduler needs --backend dask"),
        ([*RUN, "--backend", "ray"], "--backend"),
        ([*RUN, "--import", "no_such_module"], "no_such_module"),
        (["show", "--method", "toy_search", "--task", "pull"], "toy_reach"),
        (["status", "--results", "no/such/folder"], "no/such/folder"),
        (["plot", "--results", "no/such/folder"], "no/such/folder"),
        (["plot", "no_figure"], "learning_curves"),
    ],
)
def test_bad_input_is_answered_in_two_lines_that_name_it(
    arguments: list[str],
    named: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    told = capsys.readouterr().err.strip()
    assert named in told
    assert told.count("\n") <= 1
    assert not list(tmp_path.glob("results/runs/*/*/*"))


def test_python_dash_m_is_the_same_program() -> None:
    done = subprocess.run([sys.executable, "-m", "codesign_bench", "--version"], capture_output=True, text=True)
    assert (done.returncode, done.stdout.split()[0]) == (0, "codesign-bench")
