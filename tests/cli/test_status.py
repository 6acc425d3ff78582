"""`codesign-bench status` tells what a results folder holds, and why cells failed."""

from __future__ import annotations

from pathlib import Path

import pytest

from builders import store_cell
from codesign_bench.cli import main
from codesign_bench.storage.records import FAILED, Failure


def test_status_tells_why_a_cell_failed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    failure = Failure("the toy broke", "Traceback\nRuntimeError: the toy broke\n")
    store_cell(tmp_path, status=FAILED, failure=failure)
    assert main(["status", "--results", str(tmp_path)]) == 0
    assert capsys.readouterr().out.splitlines()[-1].endswith("RuntimeError: the toy broke")
