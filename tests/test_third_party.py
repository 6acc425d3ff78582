"""Another package's task and methods behave like built-in ones: installed, or named by `--import`."""

from __future__ import annotations

import importlib
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest

from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.method import Problem
from codesign_bench.seeding import Streams

TESTS = Path(__file__).parent
EXAMPLE = TESTS / "third_party"
MEMBERS = ("reach", "random_search", "sac", "tool_lengths", "fitting_lengths")
LISTINGS = (
    *(f"cli/test_{command}.py" for command in ("list", "show", "status", "program")),
    *("docs/test_pages.py", "test_architecture.py"),
)
"""Tests of what shows all members."""
COMPARISONS = ("study", "claims/test_verify.py")
"""Tests of what compares all members."""
IMPORTS = tuple(f"--import=reach_example.{name}" for name in ("reach", "random_search", "sac"))
SMALL_SAC = ("batch_size=250", "minibatch_size=32", "updates_per_step=0.05", "replay_size=2000")
"""Batches are short, and the replay buffer overflows."""
TRAIN = {
    "random_search": ("--steps", "30000", "--set", "evaluations=3"),
    "sac": ("--steps", "3000", "--set", "evaluations=3", *SMALL_SAC),
}
METHODS = tuple(TRAIN)
UNFINISHED = """
import time
from codesign_bench.sweep import training

save, saved = training.save_checkpoint, []

def save_twice(*arguments):
    while len(saved) == 2:
        time.sleep(0.1)
    saved.append(save(*arguments))

training.save_checkpoint = save_twice
"""
"""A module with which no process trains a cell beyond its third batch: there is time to kill it."""


def train(method: str, out: Path) -> tuple[str, ...]:
    """Return the command that trains a method of the example on its task."""
    start = ("run", "--task", "reach", "--method", method, "--seeds", "1", "--jobs", "1", "--out", str(out))
    return (*start, *TRAIN[method])


def cell(out: Path, method: str) -> Path:
    """Return the folder of the method's only cell."""
    return out / "reach" / method / "default" / "seed-00"


def process(*arguments: str, path: Path, more: Path | None = None) -> subprocess.Popen[str]:
    """Start `codesign-bench` with the folder `path`, and that of `more`, searched for modules."""
    searched = os.pathsep.join(str(folder) for folder in (path, more) if folder is not None)
    environment = {**os.environ, "PYTHONPATH": searched, "CODESIGN_BENCH_CHECKPOINT_SECONDS": "0"}
    line = [sys.executable, "-m", "codesign_bench", *arguments]
    return subprocess.Popen(line, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def command(*arguments: str, path: Path, status: int = 0) -> tuple[str, str]:
    """Run `codesign-bench` to its end, which must have the exit code `status`; return what it wrote."""
    started = process(*arguments, path=path)
    output, errors = started.communicate(timeout=180)
    assert started.returncode == status, output + errors
    return output, errors


def suite(*arguments: str, path: Path) -> str:
    """Run tests of this suite with the package in the folder `path` installed, which must pass; return the output."""
    arguments = (*arguments, f"--ignore={__file__}", "-m", "not slow and not reference")
    line = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *arguments]
    environment = {**os.environ, "PYTHONPATH": str(path), "OMP_NUM_THREADS": "1"}
    done = subprocess.run(line, cwd=TESTS.parent, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-10_000:]
    return done.stdout


def curve(folder: Path) -> pd.DataFrame:
    """Return the learning curve of the cell in `folder` without the time it took."""
    return pd.read_csv(folder / "curve.csv").drop(columns="wall_s")


def cell_status(folder: Path) -> str:
    """Return the status that the cell's file gives."""
    return str(json.loads((folder / "cell.json").read_text())["status"])


def assert_same_results(first: Path, second: Path) -> None:
    """Assert that two cells learned the same, to the last bit."""
    pd.testing.assert_frame_equal(curve(first), curve(second), check_exact=True)
    for name in ("metrics.csv", "evaluation.csv", "policy.safetensors"):
        assert (first / name).read_bytes() == (second / name).read_bytes(), name


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
    """Return a results folder with a cell of each method that the installed example trained undisturbed."""
    out = tmp_path_factory.mktemp("results") / "runs"
    for method in METHODS:
        command(*train(method, out), path=installed)
    return out


def test_the_example_is_unknown_until_it_is_installed(tmp_path: Path) -> None:
    _, errors = command(*train("random_search", tmp_path), path=tmp_path, status=2)
    assert "random_search" in errors or "reach" in errors
    assert len(errors.splitlines()) <= 2


@pytest.mark.parametrize("imports", [(), IMPORTS], ids=["installed", "imported"])
def test_it_is_listed(imports: tuple[str, ...], installed: Path) -> None:
    listing, _ = command("list", *imports, path=EXAMPLE if imports else installed)
    assert all(name in listing for name in ("reach", *METHODS))


def test_it_trains(results: Path) -> None:
    for method in METHODS:
        assert cell_status(cell(results, method)) == "done"
    found = curve(cell(results, "random_search"))
    assert found["env_steps"].iloc[-1] >= 30_000
    assert found["return_mean"].iloc[-1] > found["return_mean"].iloc[0]


def test_it_plots(results: Path, installed: Path, tmp_path: Path) -> None:
    output, _ = command("plot", "--results", str(results), "--out", str(tmp_path), path=installed)
    assert output.splitlines()[-1].endswith("learning_curves.png")
    assert "reach" in (tmp_path / "learning_curves.csv").read_text()
    assert (tmp_path / "learning_curves.png").stat().st_size > 0


def test_a_module_named_on_the_command_line_learns_the_same(results: Path, tmp_path: Path) -> None:
    command(*train("random_search", tmp_path), *IMPORTS, path=EXAMPLE)
    assert_same_results(cell(tmp_path, "random_search"), cell(results, "random_search"))


@pytest.mark.parametrize(("method", "kills"), [("random_search", 1), pytest.param("sac", 2, marks=pytest.mark.slow)])
def test_a_killed_cell_resumes_to_the_bit(
    results: Path, installed: Path, tmp_path: Path, method: str, kills: int
) -> None:
    (tmp_path / "unfinished.py").write_text(UNFINISHED)
    out = tmp_path / "runs"
    folder, before = cell(out, method), 0.0
    for _ in range(kills):
        started = process(*train(method, out), "--import", "unfinished", path=installed, more=tmp_path)
        before = wait_for_a_later_checkpoint(folder, before)
        started.kill()
        started.communicate(timeout=120)
        assert cell_status(folder) == "running"
    if method == "sac":
        assert len(list(folder.glob("checkpoint.large-*.npz"))) >= 1, "the replay buffer lies beside the checkpoint"
    command(*train(method, out), path=installed)
    assert_same_results(folder, cell(results, method))
    assert list(folder.glob("checkpoint*")) == []


def wait_for_a_later_checkpoint(folder: Path, before: float) -> float:
    """Wait until the cell in `folder` has saved a checkpoint after the time `before`; return when."""
    path, deadline = folder / "checkpoint.safetensors", time.monotonic() + 120
    while not path.exists() or path.stat().st_mtime <= before:
        assert time.monotonic() < deadline, "no checkpoint was made"
        time.sleep(0.01)
    return path.stat().st_mtime


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_an_off_policy_learner_learns_to_reach(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(EXAMPLE))
    sac, reach = (importlib.import_module(f"reach_example.{name}") for name in ("sac", "reach"))
    method, left = sac.Sac(Problem(reach.Reach()), sac.Config(), Streams(seed)), 12_000
    start = evaluate(method.problem.task, method.policy()).summary["success_rate"]
    while left > 0:
        left -= method.train(left).env_steps
    assert start < 0.2 < 0.8 <= evaluate(method.problem.task, method.policy()).summary["success_rate"]


def test_its_members_keep_every_promise_that_is_tested_of_members(installed: Path) -> None:
    told = suite("-v", "--members", ",".join(MEMBERS), path=installed)
    passed = [line for line in told.splitlines() if " PASSED" in line]
    for member in MEMBERS:
        assert any(f"[{member}" in name or f"-{member}" in name for name in passed), f"nothing was asked of {member}"


@pytest.mark.parametrize(
    "names", [LISTINGS, pytest.param(COMPARISONS, marks=pytest.mark.slow)], ids=["lists", "compares"]
)
def test_everything_that_lists_or_compares_members_holds_with_it(names: tuple[str, ...], installed: Path) -> None:
    suite("-q", *(str(TESTS / name) for name in names), path=installed)


def test_changed_code_of_a_package_is_told_and_changed_own_code_of_a_member_refused(tmp_path: Path) -> None:
    shutil.copytree(EXAMPLE, tmp_path / "package", ignore=shutil.ignore_patterns("__pycache__"))
    package, out = tmp_path / "package" / "reach_example", tmp_path / "runs"
    small = ("--task", "reach", "--method", "random_search", "--steps", "600", "--set", "evaluations=1")
    again = ("run", *IMPORTS, *small, "--out", str(out))

    def edit(name: str, text: str) -> str:
        with open(package / name, "a") as file:
            file.write(text)
        return command(*again, path=package.parent)[0]

    command(*again, path=package.parent)
    assert "other code" not in edit("../README.md", "A word.")
    own = edit("reach.py", "\n# A comment.\n")
    assert "1 of them already done" in own
    assert "1 stored cell with other code of reach_example: " in own
    assert "1 stored cell with other code of reach_example: " in edit("tool_lengths.py", "\nNUMBER = 1\n")
    before = (cell(out, "random_search") / "cell.json").read_bytes()
    with open(package / "reach.py", "a") as file:
        file.write("\nNUMBER = 1\n")
    told = command(*again, path=package.parent, status=2)[1]
    assert "was run with other code of task 'reach' (reach_example.reach)" in told
    assert len(told.splitlines()) == 2
    assert (cell(out, "random_search") / "cell.json").read_bytes() == before
    assert "all 1 cells done" in command(*again, "--same-code", path=package.parent)[0]
