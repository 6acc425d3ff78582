"""`codesign-bench show` tells the source of every value."""

from __future__ import annotations

import re

import pytest

from codesign_bench import method_names, task_names
from codesign_bench.cli import main

pytestmark = pytest.mark.usefixtures("toy")


def test_show_tells_the_source_of_every_value(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["show", "--method", "toy_search", "--task", "toy_reach", "--profile", "paper", "--set", "widths=1,2"]
    assert main(arguments) == 0
    rows = {line.split()[1]: line for line in capsys.readouterr().out.splitlines()}
    assert rows["version"].split() == ["task", "version", "1", "toy_reach"]
    assert rows["widths"].split()[2:5] == ["[1,", "2]", "--set"]
    assert re.search(r"toy paper, table 1 +a number +0\.01 to 1, log$", rows["step_size"])
    assert re.search(r"toy paper, table 2 +an integer +integers 2 to 8$", rows["episodes"])
    assert re.search(r"paper, learning curves +an integer from 1 to 1,000,000,000,000$", rows["steps"])


def test_every_built_in_method_can_be_shown(capsys: pytest.CaptureFixture[str]) -> None:
    for method in method_names():
        assert main(["show", "--method", method, "--task", task_names()[0], "--profile", "paper"]) == 0
    assert "paper" in capsys.readouterr().out
