"""Speeds go to a file with everything that they depend on."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from codesign_bench.benchmarks.output import write_speeds
from codesign_bench.errors import UserError
from codesign_bench.machine import package_versions


def test_a_file_holds_what_was_measured_and_under_which_conditions(tmp_path: Path) -> None:
    lines: list[str] = []
    write_speeds(tmp_path / "speed.json", {"push": 1.5}, 3, lines.append)
    content = json.loads((tmp_path / "speed.json").read_text())
    assert content["push"] == 1.5
    assert content["versions"] == package_versions()
    assert {"code", "host"} <= set(content)
    assert lines == [str(tmp_path / "speed.json")]


def test_without_a_file_nothing_is_written_or_said() -> None:
    lines: list[str] = []
    write_speeds(None, {}, 1, lines.append)
    assert lines == []


def test_a_file_that_cannot_be_written_is_an_error_of_the_user(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="--out"):
        write_speeds(tmp_path, {}, 1, pytest.fail)
