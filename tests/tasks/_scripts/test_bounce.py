"""The script of bounce: it solves most goals, no one of its strips solves as many, and it predicts where balls land."""

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

bounce: Any = load_module("tasks", "bounce")
script: Any = import_module("codesign_bench.tasks._scripts.bounce")
TASK = load_task("bounce")


def test_it_solves_most_goals_and_with_one_strip_hardly_half_as_many() -> None:
    goals = TASK.evaluation_instances()[:24]
    own = evaluate(TASK, TASK.script(), instances=goals)
    tools = TASK.design_space.to_unit(own.designs[:6])
    alone = [evaluate(TASK, GivenDesigns(tool, TASK.script()), instances=goals).successes.mean() for tool in tools]
    assert own.successes.mean() > 0.85
    assert max(alone) < 0.6 * own.successes.mean()


def test_a_ball_on_a_level_strip_comes_down_where_it_fell() -> None:
    level = bounce.bent_strip(np.array([[0.0, 0.0, 0.0, 1.5, 1.5]]))
    balls = np.array([[-1.0, 4.5, 0.0, 0.0], [0.5, 4.5, 0.0, 0.0], [2.5, 4.5, 0.0, 0.0]])
    missed = script.miss(level, balls, np.array([3.0, 0.0]))
    np.testing.assert_allclose(missed[0, :2], [4.0, 2.5], atol=1e-9)
    assert missed[0, 2] > 5.0, "beside the strip"


def test_a_ball_that_stays_below_the_hoop_misses_by_the_height_it_lacks() -> None:
    level = bounce.bent_strip(np.array([[0.0, 0.0, 0.0, 1.5, 1.5]]))
    # It bounces back to 0.64 of the height that it fell.
    gap = bounce.BALL_RADIUS + bounce.STRIP_HALF_WIDTH
    top = gap + bounce.RESTITUTION**2 * (4.5 - gap)
    missed = script.miss(level, np.array([[0.0, 4.5, 0.0, 0.0]]), np.array([0.0, top + 0.7]))
    assert missed[0, 0] == pytest.approx(0.7)
