"""Invalid command lines are refused: exit code 2, at most three lines, no traceback, and nothing left behind."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from command_lines import Line, answered_by_a_process, faults, invalid_lines, sample

from codesign_bench.cli import main

LINES = invalid_lines()


def wrong_answers(lines: list[Line], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Return what is wrong with the answers to command lines that are asked one after the other in an empty folder."""
    wrong = []
    for line in lines:
        code = main(line.words)
        found = faults(line, code, capsys.readouterr().err, os.listdir(tmp_path))
        for name in os.listdir(tmp_path):  # or all that follow would be blamed for it, too
            shutil.rmtree(tmp_path / name, ignore_errors=True)
        wrong += [f"{' '.join(line.words)[:200]}: {fault}" for fault in found]
    return wrong


def test_the_list_covers_every_command_and_is_long() -> None:
    assert len(LINES) >= 500
    assert {line.words[0] for line in LINES} >= {"run", "show", "tune", "status", "plot", "verify", "report", "bench"}


def test_a_sample_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert wrong_answers(sample(LINES, 0.02), tmp_path, capsys) == []


@pytest.mark.slow
def test_all_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    assert wrong_answers(LINES, tmp_path, capsys) == []


@pytest.mark.slow
@pytest.mark.parametrize("line", sample(LINES, 0.005), ids=lambda line: " ".join(line.words)[-40:])
def test_a_process_refuses_them_alike(line: Line) -> None:
    assert answered_by_a_process(line) == []
