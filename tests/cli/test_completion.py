"""A shell completes commands, options and names, by asking the program itself."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from codesign_bench.cli import main
from codesign_bench.registry import names


def completions(line: str, tmp_path: Path) -> set[str]:
    """Return what a shell is offered at the end of a command line."""
    pytest.importorskip("argcomplete")
    answers = tmp_path / "answers"
    environment = {
        **os.environ,
        **{"_ARGCOMPLETE": "1", "_ARGCOMPLETE_IFS": "\n", "_ARGCOMPLETE_STDOUT_FILENAME": str(answers)},
        **{"COMP_LINE": line, "COMP_POINT": str(len(line)), "COMP_TYPE": "9", "_ARGCOMPLETE_SUPPRESS_SPACE": "1"},
    }
    call = "import sys; from codesign_bench.cli import main; main()"
    subprocess.run([sys.executable, "-c", call], env=environment, capture_output=True, timeout=120, check=False)
    return {answer.strip() for answer in answers.read_text().splitlines()}


def test_commands_are_completed(tmp_path: Path) -> None:
    assert completions("codesign-bench re", tmp_path) == {"rerun", "report", "reproduce", "reference", "render"}


def test_options_are_completed(tmp_path: Path) -> None:
    assert completions("codesign-bench status --w", tmp_path) == {"--watch"}


def test_names_of_members_are_completed(tmp_path: Path) -> None:
    assert completions("codesign-bench run --task ", tmp_path) >= {*names("tasks"), "all"}
    assert completions("codesign-bench run --method cma", tmp_path) == {"cma_rl", "cma_es"}
    assert "learning_curves" in completions("codesign-bench plot learn", tmp_path)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_code_for_a_shell_names_the_program(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("argcomplete")
    assert main(["completion", shell]) == 0
    assert "codesign-bench" in capsys.readouterr().out


def test_without_the_package_its_extra_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "argcomplete", None)
    assert main(["completion", "bash"]) == 2
    assert "pip install 'codesign-bench[completion]'" in capsys.readouterr().err
