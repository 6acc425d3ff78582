"""`codesign-bench doctor` prints headings, with facts below each."""

from __future__ import annotations

import pytest

from codesign_bench.cli import main


def test_it_prints_versions_and_members(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor"]) == 0
    lines = capsys.readouterr().out.splitlines()
    headings = [line for line in lines if not line.startswith(" ")]
    assert headings == ["codesign-bench", "system", "threads", "packages", "extras", "members"]
    assert any(line.split()[0] == "numpy" for line in lines)
