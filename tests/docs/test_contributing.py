"""CONTRIBUTING.md works as written: its files in an empty folder make a package, and its commands run there."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import contributing

PROGRAMS = {"pip": "pip", "codesign-bench": "codesign_bench"}
"""Command -> the module that it runs."""


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the files of the page and nothing else."""
    folder = tmp_path_factory.mktemp("empty")
    for name, text in contributing.files().items():
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return an environment in which the commands are those of this Python, and pip needs no network."""
    programs, installed = tmp_path_factory.mktemp("programs"), tmp_path_factory.mktemp("installed")
    for command, module in PROGRAMS.items():
        script = programs / command
        script.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m {module} "$@"\n')
        script.chmod(0o755)
    offline = {"PIP_NO_DEPS": "1", "PIP_NO_BUILD_ISOLATION": "0", "PIP_NO_INDEX": "1", "PIP_TARGET": str(installed)}
    searched = os.pathsep.join([str(programs), os.environ["PATH"]])
    return {**os.environ, **offline, "PATH": searched, "PYTHONPATH": str(installed), "OMP_NUM_THREADS": "1"}


def run(lines: str, folder: Path, environment: dict[str, str]) -> str:
    """Run lines of a shell, all of which must succeed; return what they print."""
    shell = ["/bin/sh", "-e", "-c", lines]
    done = subprocess.run(shell, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_page_writes_out_a_package_and_its_commands() -> None:
    assert {"pyproject.toml", "line_tools/__init__.py", "line_tools/touch.py", "line_tools/guess.py"} == set(
        contributing.files()
    )
    words = " ".join(contributing.commands())
    for needed in ("pip install .", "codesign-bench check", "codesign-bench run", "codesign-bench plot", "--import"):
        assert needed in words


def test_the_commands_of_the_page_run_as_written(package: Path, environment: dict[str, str]) -> None:
    installed, imported = contributing.commands()
    printed = run(installed, package, environment)
    assert "2 of 2 keep the contract" in printed
    assert "all 2 cells done" in printed
    figure = package / printed.splitlines()[-1]
    assert figure.name == "learning_curves.png"
    assert figure.stat().st_size > 0
    # Without the installed package: only what is named on the command line is found.
    printed = run(imported, package, {**environment, "PYTHONPATH": ""})
    assert "task touch: " in printed
    assert " wrong" not in printed
    assert "2 of them already done" in printed
    assert "all 3 cells done" in printed
