"""`codesign-bench deploy` refuses what does not go together."""

from __future__ import annotations

import pytest

from codesign_bench.cli import main


def test_the_command_refuses_what_does_not_go_together(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["deploy", "--policy", "cell", "--protocol", "--trials", "2"]) == 2
    assert "--protocol sets tools and trials itself" in capsys.readouterr().err
    assert main(["deploy", "--policy", "nowhere"]) == 2
    assert "'nowhere' is not a cell folder" in capsys.readouterr().err
