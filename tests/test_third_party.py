"""Another package's task and method behave like built-in ones: installed, or named by `--import`."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest

EXAMPLE = Path(__file__).parent / "third_party"
IMPORTS = ("--import", "reach_example.reach", "--import", "reach_example.random_search")
SIZE = ("--seeds", "1", "--steps", "100000", "--set", "evaluations=3", "--jobs", "1")
TRAIN = ("run", "--task", "reach", "--method", "random_search", *SIZE)
CELL = Path("reach/random_search/default/seed-00")


def process(*arguments: str, path: Path) -> subprocess.Popen[str]:
    """Start `codesign-bench` with the folder `path` searched for modules."""
    environment = {**os.environ, "PYTHONPATH": str(path), "CODESIGN_BENCH_CHECKPOINT_SECONDS": "0"}
    line = [sys.executable, "-m", "codesign_bench", *arguments]
    return subprocess.Popen(line, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def command(*arguments: str, path: Path, status: int = 0) -> tuple[str, str]:
    """Run `codesign-bench` to its end, which must have the exit code `status`; return what it wrote."""
    started = process(*arguments, path=path)
    output, errors = started.communicate(timeout=180)
    assert started.returncode == status, output + errors
    return output, errors


def curve(out: Path) -> pd.DataFrame:
    """Return the learning curve without the time it took."""
    return pd.read_csv(out / CELL / "curve.csv").drop(columns="wall_s")


def cell_status(out: Path) -> str:
    """Return the status that the cell's file tells."""
    return str(json.loads((out / CELL / "cell.json").read_text())["status"])


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder into which pip installed a copy of the example."""
    folder = tmp_path_factory.mktemp("third_party")
    shutil.copytree(EXAMPLE, folder / "source", ignore=shutil.ignore_patterns("__pycache__"))
    options = ["--no-deps", "--no-build-isolation", "--quiet", "--target", str(folder / "installed")]
    line = [sys.executable, "-m", "pip", "install", *options, str(folder / "source")]
    result = subprocess.run(line, capture_output=True, text=True, timeout=120, check=False)
    assert result.returncode == 0, result.stderr
    return folder / "installed"


@pytest.fixture(scope="module")
def results(installed: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a results folder with one cell that the installed example trained without a disturbance."""
    out = tmp_path_factory.mktemp("results") / "runs"
    command(*TRAIN, "--out", str(out), path=installed)
    return out


def test_the_example_is_unknown_until_it_is_installed(tmp_path: Path) -> None:
    _, errors = command(*TRAIN, "--out", str(tmp_path), path=tmp_path, status=2)
    assert "random_search" in errors or "reach" in errors
    assert len(errors.splitlines()) <= 2


@pytest.mark.parametrize("imports", [(), IMPORTS], ids=["installed", "imported"])
def test_it_is_listed(imports: tuple[str, ...], installed: Path) -> None:
    listing, _ = command("list", *imports, path=EXAMPLE if imports else installed)
    assert "reach" in listing
    assert "random_search" in listing


def test_it_trains(results: Path) -> None:
    assert cell_status(results) == "done"
    assert curve(results)["env_steps"].iloc[-1] >= 100_000
    assert curve(results)["return_mean"].iloc[-1] > curve(results)["return_mean"].iloc[0]


def test_it_plots(results: Path, installed: Path, tmp_path: Path) -> None:
    output, _ = command("plot", "--results", str(results), "--out", str(tmp_path), path=installed)
    assert output.splitlines()[-1].endswith("learning_curves.png")
    assert "reach" in (tmp_path / "learning_curves.csv").read_text()
    assert (tmp_path / "learning_curves.png").stat().st_size > 0


def test_a_module_named_on_the_command_line_learns_the_same(results: Path, tmp_path: Path) -> None:
    command(*TRAIN, *IMPORTS, "--out", str(tmp_path), path=EXAMPLE)
    pd.testing.assert_frame_equal(curve(results), curve(tmp_path))


def test_a_killed_cell_goes_on_where_it_stood(results: Path, installed: Path, tmp_path: Path) -> None:
    started = process(*TRAIN, "--out", str(tmp_path), path=installed)
    deadline = time.monotonic() + 120
    while not (tmp_path / CELL / "checkpoint.safetensors").exists() and time.monotonic() < deadline:
        time.sleep(0.01)
    started.kill()
    started.communicate(timeout=60)
    assert cell_status(tmp_path) == "running", "it was not killed in time: the test shows nothing"
    command(*TRAIN, "--out", str(tmp_path), path=installed)
    pd.testing.assert_frame_equal(curve(results), curve(tmp_path))
