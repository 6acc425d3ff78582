"""What is settled before anything is imported: the module path, standard streams that are closed, and Ctrl-C."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from codesign_bench.startup import imports_of, search_folder

START = "import os, signal, sys; {first}; os.execv(sys.executable, [sys.executable, {program!r}])"
"""Starts a program in this process, once it has done something first."""


@pytest.mark.parametrize(
    ("value", "modules", "folder"),
    [("", [], ""), ("a", ["a"], ""), ("a,b.c", ["a", "b.c"], ""), ("a,b=/x,y=z", ["a", "b"], "/x,y=z")],
)
def test_the_variable_holds_modules_and_a_folder(value: str, modules: list[str], folder: str) -> None:
    assert imports_of(value) == (modules, folder)


def test_a_folder_is_searched_for_named_modules_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "meta_path", list(sys.meta_path))
    for name in ("a_named_one", "another_one"):
        (tmp_path / f"{name}.py").write_text("")
    finder = search_folder(str(tmp_path), ["a_named_one.part"])
    assert sys.meta_path[-1] is finder
    assert finder.find_spec("another_one") is None
    assert not finder.used
    assert finder.find_spec("a_named_one") is not None
    assert finder.used
    assert search_folder(str(tmp_path), ["another_one"]) is finder
    assert finder.find_spec("another_one") is not None


@pytest.mark.parametrize("numbers", [(1,), (2,), (0, 1, 2)])
def test_a_file_never_gets_the_number_of_a_stream_that_was_closed(numbers: tuple[int, ...], tmp_path: Path) -> None:
    check = tmp_path / "codesign-bench"
    check.write_text(
        "import codesign_bench, os, sys\n"
        f"number = os.open({str(tmp_path / 'opened')!r}, os.O_CREAT | os.O_WRONLY)\n"
        "print('words of a library'); sys.stdout.flush(); os.write(1, b'more'); os.write(2, b'more')\n"
        "os.write(number, str(number > 2).encode())\n"
    )
    line = START.format(first=f"[os.close(number) for number in {numbers}]", program=str(check))
    assert subprocess.run([sys.executable, "-c", line], capture_output=True, timeout=120).returncode == 0
    assert (tmp_path / "opened").read_text() == "True"


def test_ctrl_c_before_a_command_begins_is_one_line(tmp_path: Path) -> None:
    program = tmp_path / "codesign-bench"
    program.write_text("import codesign_bench, os, signal\nos.kill(os.getpid(), signal.SIGINT)\nprint('went on')\n")
    line = START.format(first="signal.signal(signal.SIGINT, signal.SIG_DFL)", program=str(program))
    done = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "\ninterrupted\n")


def test_a_script_that_imports_the_package_keeps_its_path_and_its_ctrl_c() -> None:
    line = (
        # A process that was started in the background ignores Ctrl-C, whatever is imported.
        "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
        "before = list(sys.path); import codesign_bench; "
        "print(sys.path == before, signal.getsignal(signal.SIGINT) is signal.default_int_handler)"
    )
    done = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, timeout=120)
    assert done.stdout == "True True\n"
