"""The script of push: its tools bring the puck to most goals, and no one of them to as many."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.task import load_task
from codesign_bench.task.behaviours import GivenDesigns
from codesign_bench.task.episodes import Episodes

pytestmark = pytest.mark.numeric

TASK = load_task("push")
SCRIPT: Any = TASK.script()
SHAPES = np.array(SCRIPT.SHAPES)
PUCK = np.array([0.5 * (low + high) for low, high in zip(TASK.goal_space.low, TASK.goal_space.high, strict=True)])
"""Where the puck starts: in the middle of the ring of goals."""


def test_it_solves_most_goals_and_with_one_tool_hardly_half_as_many() -> None:
    goals = TASK.evaluation_instances()[:40]
    own = evaluate(TASK, SCRIPT, instances=goals).successes.mean()
    alone = [evaluate(TASK, GivenDesigns(shape[None], SCRIPT), instances=goals).successes.mean() for shape in SHAPES]
    assert own > 0.6
    assert max(alone) < own - 0.2


@pytest.mark.parametrize("eighth", range(8))
def test_the_tool_follows_the_direction_of_the_goal_anticlockwise_from_the_right(eighth: int) -> None:
    angle = 0.25 * np.pi * eighth
    goal = PUCK + 3.0 * np.array([np.cos(angle), np.sin(angle)])
    episodes = Episodes(TASK, 1)
    episodes.begin(np.array([0]), goal[None])
    np.testing.assert_allclose(SCRIPT.design(episodes.observation)[0], SHAPES[eighth], rtol=1e-6)
