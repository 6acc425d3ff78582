"""The script of lift cup: its own forks lift every cup, random ones few."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.task import load_task
from codesign_bench.task.behaviours import GivenDesigns

pytestmark = pytest.mark.numeric


def test_it_lifts_cups_of_every_corner_and_random_tools_do_so_rarely() -> None:
    task = load_task("lift_cup")
    cups = np.array(list(product(*zip(task.goal_space.low, task.goal_space.high, strict=True))))
    assert evaluate(task, task.script(), instances=cups).successes.all()
    count = task.max_slots  # As many as are played side by side.
    tools = np.random.default_rng(0).uniform(-1.0, 1.0, size=(count, task.design_space.size))
    some = evaluate(task, GivenDesigns(tools, task.script()), instances=task.evaluation_instances()[:count])
    assert 0.0 < some.successes.mean() < 0.35
