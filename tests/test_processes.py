"""Child processes compute in one thread each, and none outlives its parent."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from codesign_bench.processes import (
    EXIT_ORPHANED,
    THREAD_VARIABLES,
    children_with_safe_modules,
    python_process,
    thread_environment,
)
from codesign_bench.startup import SAFE_PATH_VARIABLE

SLEEPER = (
    "import os, sys, time\n"
    "from codesign_bench.processes import end_with\n"
    "end_with(int(sys.argv[1]))\n"
    "print(os.getpid(), flush=True)\n"
    "time.sleep({seconds})\n"
    "print('slept')\n"
)
"""A child that would sleep, and ends with the process whose number it is given."""
PARENT = (
    "import os, subprocess, sys\n"
    "child = subprocess.Popen([sys.executable, '-c', sys.argv[1], str(os.getpid())])\n"
    "sys.stdin.readline()\n"
)
"""A parent that starts the sleeper and ends when it is told to; the sleeper keeps its output open."""


@pytest.fixture
def parent() -> Iterator[subprocess.Popen[str]]:
    """A process that has started a sleeper."""
    command = [sys.executable, "-c", PARENT, SLEEPER.format(seconds=60)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        yield process
        process.kill()


def test_numerical_libraries_get_one_thread_and_the_rest_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "8")
    monkeypatch.setenv("MINE", "kept")
    environment = thread_environment()
    assert {environment[name] for name in THREAD_VARIABLES} == {"1"}
    assert environment["MINE"] == "kept"
    assert os.environ["OMP_NUM_THREADS"] == "8"


def test_a_process_ends_when_its_parent_is_killed(parent: subprocess.Popen[str]) -> None:
    assert parent.stdout is not None
    orphan = int(parent.stdout.readline())
    os.kill(orphan, 0)  # it lives
    parent.kill()
    assert parent.stdout.read() == "", "the pipe closes with the last process that holds it, before that has slept"
    assert parent.wait() < 0


def test_an_orphan_ends_with_a_code_of_its_own_and_others_go_on() -> None:
    orphaned = subprocess.run([sys.executable, "-c", SLEEPER.format(seconds=60), "-1"], capture_output=True)
    assert orphaned.returncode == EXIT_ORPHANED
    own = [sys.executable, "-c", SLEEPER.format(seconds=0.01), str(os.getpid())]
    assert subprocess.run(own, capture_output=True).returncode == 0


@pytest.mark.parametrize("before", [None, "", "1"])
def test_the_module_path_of_children_is_safe_only_meanwhile(
    before: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(SAFE_PATH_VARIABLE, raising=False)
    if before is not None:
        monkeypatch.setenv(SAFE_PATH_VARIABLE, before)
    with children_with_safe_modules():
        assert os.environ[SAFE_PATH_VARIABLE] == "1"
    assert os.environ.get(SAFE_PATH_VARIABLE) == before


def test_a_process_runs_a_modules_start_and_ends_when_its_parent_lets_go(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "patient.py").write_text(
        "import sys, time\n"
        "from codesign_bench.processes import watched_by_parent\n"
        "def start():\n"
        "    watched_by_parent()\n"
        "    print(sys.argv[1], flush=True)\n"
        "    time.sleep(60)\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    process = python_process("patient", "an argument")
    assert process.stdout.readline() == "an argument\n"
    process.stdin.close()
    assert process.wait(timeout=30) == EXIT_ORPHANED
    process.stdout.close()
    process.stderr.close()
