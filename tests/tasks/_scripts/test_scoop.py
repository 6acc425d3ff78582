"""The script of scoop: the shape of its ladles decides how many balls come along."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.registry import load_module
from codesign_bench.task import load_task
from codesign_bench.task.behaviours import GivenDesigns

pytestmark = pytest.mark.numeric

scoop: Any = load_module("tasks", "scoop")


def test_it_scoops_most_numbers_with_its_own_tools_and_few_with_one() -> None:
    task = load_task("scoop")
    wanted = np.repeat(np.arange(scoop.GOAL_NUMBERS[0], scoop.GOAL_NUMBERS[1] + 1), 6)
    instances = task.sample_instances(np.random.default_rng(3), len(wanted))
    instances[:, scoop.WANTED] = wanted
    script = task.script()
    own = evaluate(task, script, instances=instances)
    assert own.successes.mean() > 0.5
    means = [own.outcomes[wanted == number].mean() for number in np.unique(wanted)]
    assert np.corrcoef(means, np.unique(wanted))[0, 1] > 0.95
    for number in (2, 4, 6):  # With one tool, whatever is wanted, the script lifts what fits into it.
        shown = np.full(task.layout.size, number, np.float32)
        one = evaluate(task, GivenDesigns(script.design(shown), script), instances=instances)
        assert one.successes[wanted != number].mean() < 0.3
        assert np.abs(one.outcomes - number).mean() < 2.0
