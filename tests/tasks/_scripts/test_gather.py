"""The script of gather: it solves most goals, and no one of its blades solves as many."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.registry import load_module
from codesign_bench.task import load_task
from codesign_bench.task.behaviours import GivenDesigns
from codesign_bench.task.episodes import Episodes

pytestmark = pytest.mark.numeric

gather: Any = load_module("tasks", "gather")
TASK = load_task("gather")


def test_it_solves_most_goals_and_with_one_blade_hardly_half_as_many() -> None:
    goals = TASK.evaluation_instances()[:24]
    own = evaluate(TASK, TASK.script(), instances=goals)
    tools = TASK.design_space.to_unit(own.designs[:6])
    alone = [evaluate(TASK, GivenDesigns(tool, TASK.script()), instances=goals).successes.mean() for tool in tools]
    assert own.successes.mean() > 0.75
    assert max(alone) < 0.7 * own.successes.mean()


@pytest.mark.parametrize("goal_x", [-1.6, -0.8, 0.8, 1.6])
def test_the_deepest_place_of_the_blade_is_before_the_circle_or_a_little_beyond(goal_x: float) -> None:
    episodes = Episodes(TASK, 1)
    instance = TASK.evaluation_instances()[:1].copy()
    instance[0, gather.GOAL.start] = goal_x
    episodes.begin(np.array([0]), instance)
    points = gather.blade(TASK.design_space.from_unit(TASK.script().design(episodes.observation)))[0]
    deepest = points[points[:, 1].argmin(), 0]
    expected = goal_x + np.sign(goal_x) * TASK.script().BEYOND  # type: ignore[attr-defined]
    assert abs(deepest - expected) <= 0.5 * gather.SEGMENT_WIDTH + 1e-6
