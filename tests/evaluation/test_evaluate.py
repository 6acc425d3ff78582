"""Evaluation against episodes that can be reckoned by hand: a stick of known length that does not move."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from codesign_bench.evaluation.evaluate import evaluate, rows
from codesign_bench.task import Task, load_task
from codesign_bench.task.episodes import Tradeoff, portions

pytestmark = pytest.mark.usefixtures("toy")


@pytest.fixture
def task(toy: None) -> Task:
    return load_task("toy_reach")


def constant(design: float, control: float) -> Any:
    from toy import ConstantPolicy

    return ConstantPolicy(np.array([design, control]))


def test_returns_successes_and_lengths(task: Task) -> None:
    # The stick is 1 m long and stays: goal 1.0 is touched in the first step, goal 0.5 never, at 0.5 m for five steps.
    found = evaluate(task, constant(1.0, 0.0), instances=np.array([[1.0], [0.5]]))
    np.testing.assert_allclose(found.returns, [0.0, -2.5])
    np.testing.assert_array_equal(found.successes, [True, False])
    np.testing.assert_array_equal(found.lengths, [1, 5])
    np.testing.assert_allclose(found.designs, [[1.0], [1.0]])
    assert found.summary == pytest.approx(
        # standard deviation of (0, -2.5) is 2.5 / sqrt(2), its standard error 2.5 / 2
        {"return_mean": -1.25, "return_se": 1.25, "success_rate": 0.5, "episode_length": 3.0}
    )


def test_the_tradeoff_counts_in_the_return(task: Task) -> None:
    # material 1, effort 0: K [1 - (0.3 * 1 + 0.7 * 0)] = 2 * 0.7 in each of five steps
    found = evaluate(task, constant(1.0, 0.0), Tradeoff(alpha=0.3, scale=2.0), instances=np.array([[0.5]]))
    np.testing.assert_allclose(found.returns, [-2.5 + 5 * 1.4])
    np.testing.assert_allclose(found.material, [1.0])
    np.testing.assert_allclose(found.effort, [0.0])


def test_the_fixed_instances_are_judged_alike_alone_and_together(task: Task) -> None:
    policy = constant(0.2, -0.4)
    together = evaluate(task, policy)
    instances = task.evaluation_instances()
    alone = [evaluate(task, policy, instances=instance[None]).returns[0] for instance in instances]
    np.testing.assert_array_equal(together.returns, alone)


def test_rows_name_instances_and_designs_and_tell_what_was_cut_out(task: Task) -> None:
    found = list(rows(task, evaluate(task, constant(1.0, 0.0), instances=np.array([[1.0], [0.5]])), cutout=0.6))
    assert [row["instance_goal"] for row in found] == [1.0, 0.5]
    assert [row["design_length"] for row in found] == [1.0, 1.0]
    assert [row["success"] for row in found] == [1, 0]
    assert [row["in_cutout"] for row in found] == [0, 1]


def test_an_evaluation_does_not_depend_on_how_many_episodes_a_simulator_holds(
    task: Task, monkeypatch: pytest.MonkeyPatch
) -> None:
    at_once = evaluate(task, constant(0.2, 0.5))
    monkeypatch.setattr(type(task), "max_slots", 3)
    assert [part.tolist() for part in portions(8, task)] == [[0, 1, 2], [3, 4, 5], [6, 7]]
    in_turn = evaluate(task, constant(0.2, 0.5))
    for name, values in vars(at_once).items():
        np.testing.assert_array_equal(values, getattr(in_turn, name), err_msg=name)
