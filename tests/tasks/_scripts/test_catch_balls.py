"""The script of catch balls: its two pans catch on their own sides."""

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

catch: Any = load_module("tasks", "catch_balls")
script: Any = import_module("codesign_bench.tasks._scripts.catch_balls")
RIGHT = np.array(script.CatchBallsScript.PAN)
LEFT = RIGHT * script.CatchBallsScript.MIRROR


def test_it_solves_most_goals_and_with_one_pan_hardly_more_than_one_side() -> None:
    task = load_task("catch_balls")
    instances = task.evaluation_instances()[:48]
    assert evaluate(task, task.script(), instances=instances).successes.mean() > 0.85
    for tool, side in ((RIGHT, 1.0), (LEFT, -1.0)):
        solved = evaluate(task, GivenDesigns(tool, task.script()), instances=instances).successes
        own = np.sign(instances[:, catch.LANDING] - catch.HAND_START[0]) == side
        assert solved[own].mean() > 0.9
        assert solved[~own].mean() < 0.1
