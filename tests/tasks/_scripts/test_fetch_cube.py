"""The script of fetch cube: it pulls cubes on both sides, a far one twice, and needs several tools for that."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.registry import load_module
from codesign_bench.task import load_task
from codesign_bench.task.behaviours import GivenDesigns

pytestmark = pytest.mark.numeric

fetch: Any = load_module("tasks", "fetch_cube")


def test_it_fetches_near_cubes_on_both_sides_and_no_single_tool_of_its_own_does() -> None:
    task = load_task("fetch_cube")
    starts = np.array([(sign * x, y) for sign in (1.0, -1.0) for x in (0.05, 0.15, 0.27) for y in (0.53, 0.58)])
    own = evaluate(task, task.script(), instances=starts)
    assert own.successes.mean() > 0.8
    for tool in task.design_space.to_unit(own.designs)[[0, 3, 5, 11]]:  # One of every kind, and a mirror image.
        assert evaluate(task, GivenDesigns(tool, task.script()), instances=starts).successes.mean() < 0.7


def test_it_fetches_a_cube_that_one_pull_does_not() -> None:
    task = load_task("fetch_cube")
    result = evaluate(task, task.script(), instances=np.array([[0.1, 0.74], [-0.1, 0.74]]))
    assert result.successes.any()
    assert 0.74 - (fetch.HOLD_Y[1] - fetch.HOLD_Y[0]) > fetch.GOAL_DISTANCE
