"""What every script promises: it solves something, whatever tool it is given it uses, and it is a pure function.

Shapes: `b` episodes side by side, `D` design, `C` control.
"""

from __future__ import annotations

import numpy as np
import pytest

from builders import offered
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.task import Behaviour, Task, load_task, task_names
from codesign_bench.task.behaviours import GivenDesigns
from codesign_bench.task.episodes import Episodes, portions

pytestmark = pytest.mark.numeric

EPISODES = 12


@pytest.fixture(params=task_names())
def task(request: pytest.FixtureRequest) -> Task:
    """Every task, one after the other."""
    return load_task(request.param)


@pytest.fixture
def script(task: Task) -> Behaviour:
    """The task's script."""
    return offered(task.script)


def test_the_script_solves_some_instances_and_other_tools_change_what_it_reaches(task: Task, script: Behaviour) -> None:
    instances = task.evaluation_instances()[:EPISODES]
    own = evaluate(task, script, instances=instances)
    assert own.successes.any()
    assert own.returns[own.successes].min() > own.returns[~own.successes].max(initial=-np.inf) - 1.0
    inside = np.random.default_rng(1).uniform(-1.0, 1.0, size=(EPISODES, task.design_space.size))
    tools = np.where(np.arange(EPISODES)[:, None] % 2 == 0, np.sign(inside), inside)  # Half of them at corners.
    reached: list[float] = []
    for part in portions(EPISODES, task):
        same = np.repeat(instances[:1], len(part), axis=0)
        others = evaluate(task, GivenDesigns(tools[part], script), instances=same)
        reached += (others.returns if task.outcome is None else others.outcomes).tolist()
    assert len(set(reached)) > 1


def test_a_script_is_a_function_of_single_observations_and_of_batches(task: Task, script: Behaviour) -> None:
    episodes, slots = Episodes(task, 3), np.arange(3)
    episodes.begin(slots, task.evaluation_instances()[:3])
    designs = script.design(episodes.observation)
    np.testing.assert_array_equal(script.design(episodes.observation[1]), designs[1])
    assert designs.shape == (3, task.design_space.size)
    assert np.abs(designs).max() <= 1.0
    episodes.design(slots, designs.astype(np.float64))
    controls = script.act(episodes.observation)
    np.testing.assert_array_equal(script.act(episodes.observation[1]), controls[1])
    assert controls.shape == (3, task.control_space.size)
    assert np.abs(controls).max() <= 1.0
