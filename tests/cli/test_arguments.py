"""Arguments that several commands share: what they mean and what they refuse."""

from __future__ import annotations

import pytest

from codesign_bench.cli import main


@pytest.mark.parametrize("command", [["render", "--out", "push.png"], ["deploy", "--policy", "x"]])
def test_a_seed_below_zero_is_refused(capsys: pytest.CaptureFixture[str], command: list[str]) -> None:
    assert main([*command, "--seed", "-1"]) == 2
    assert "argument --seed: expected an integer from 0 to 4,294,967,295, not '-1'" in capsys.readouterr().err
