"""The script of scoop 3D: it has a tool for every number, and none for all."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import pytest

from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.registry import load_module
from codesign_bench.task import load_task
from codesign_bench.task.behaviours import GivenDesigns

pytestmark = pytest.mark.numeric

scoop: Any = load_module("tasks", "scoop_3d")
script: Any = import_module("codesign_bench.tasks._scripts.scoop_3d")
NUMBERS = np.arange(scoop.WANTED[0], scoop.WANTED[1] + 1)


def test_it_solves_most_instances_and_some_of_every_number() -> None:
    task, numbers = load_task("scoop_3d"), np.tile(NUMBERS, 4)
    result = evaluate(task, task.script(), instances=np.stack([numbers, 50.0 + np.arange(28)], axis=1))
    assert result.successes.mean() > 0.7
    assert set(numbers[result.successes]) == set(numbers)


def test_no_tool_of_its_own_serves_all_numbers() -> None:
    task = load_task("scoop_3d")
    instances = np.stack([NUMBERS, np.full(len(NUMBERS), 9.0)], axis=1)
    for number in (2, 6):
        tool = np.array(script.Scoop3DScript.TOOLS[number - 1])
        assert evaluate(task, GivenDesigns(tool, task.script()), instances=instances).successes.mean() < 0.5
