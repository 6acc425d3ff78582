"""Plans repeat what was played, whoever played it, alone or beside others."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench import registry
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.evaluation.plans import plans_of, replay
from codesign_bench.seeding import generator
from codesign_bench.task import Task, load_task
from codesign_bench.task.behaviours import RandomBehaviour
from codesign_bench.task.plans import plan_size
from toy import ConstantPolicy, ToyReach

GOALS = np.array([[0.1], [0.5], [0.9]])


def test_a_plan_holds_the_design_and_every_control() -> None:
    # A stick of 0.55 m, moved by 0.05 m a step, touches 0.6 at once and 0.9 in the sixth step, which there is not.
    task, goals = ToyReach(), np.array([[0.6], [0.9]])
    played = evaluate(task, ConstantPolicy(np.array([0.0, 0.5])), instances=goals)
    plans = plans_of(played)
    assert plans.shape == (2, plan_size(task)) == (2, 1 + 5)
    assert plans[0] == pytest.approx([0.0, 0.5, 0.0, 0.0, 0.0, 0.0], abs=1e-7), "zero after the end"
    assert plans[1] == pytest.approx([0.0, 0.5, 0.5, 0.5, 0.5, 0.5], abs=1e-7)


def test_every_plan_is_played_on_its_own_instance_in_any_portions(monkeypatch: pytest.MonkeyPatch) -> None:
    task = ToyReach()
    plans = np.array([[0.0, 1, 1, 1, 1, 1], [1.0, 0, 0, 0, 0, 0], [-1.0, -1, 1, -1, 1, -1]], dtype=np.float32)
    together = replay(task, plans, GOALS)
    # 0.55 m, then 0.65 to 1.05: five gaps to 0.1; 1 m to 0.5, held; 0.1 m, then 0, 0.1, ...: to 0.9.
    assert together.returns == pytest.approx([-(0.55 + 0.65 + 0.75 + 0.85 + 0.95), -2.5, -(3 * 0.9 + 2 * 0.8)])
    monkeypatch.setattr(ToyReach, "max_slots", 1)
    alone = replay(task, plans, GOALS)
    np.testing.assert_array_equal(alone.returns, together.returns)
    np.testing.assert_array_equal(alone.controls, together.controls)


@pytest.mark.numeric
@pytest.mark.parametrize("name", registry.names("tasks"))
def test_on_every_task_a_plan_repeats_its_episode(name: str) -> None:
    task: Task = load_task(name)
    instances = task.evaluation_instances()[:2]
    played = evaluate(task, RandomBehaviour(task, generator(0, "plans")), instances=instances)
    again = replay(task, plans_of(played), instances)
    np.testing.assert_array_equal(again.returns, played.returns)
    np.testing.assert_array_equal(again.lengths, played.lengths)
    np.testing.assert_array_equal(again.successes, played.successes)
