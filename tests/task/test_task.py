"""What a task has without saying so itself."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from codesign_bench.errors import UserError
from codesign_bench.task import Task, load_task


@pytest.fixture
def task(toy: None) -> Task:
    """A stick shall touch a goal on a line, from 0 to 1 m; the goal is a position."""
    return load_task("toy_reach")


def test_the_goal_is_the_first_part_of_an_instance(task: Task) -> None:
    assert task.goal_space == task.instance_space
    assert load_task("scoop").goal_space.names == load_task("scoop").instance_space.names[:1]


def test_the_training_region_is_what_lies_between_the_bounds_of_positions(task: Task) -> None:
    inside = task.in_region(np.array([[-0.01], [0.0], [0.5], [1.0], [1.01]]))
    assert inside.tolist() == [False, True, True, True, False]


def test_evaluation_instances_are_always_the_same(task: Task) -> None:
    np.testing.assert_array_equal(task.evaluation_instances(), task.evaluation_instances())
    assert task.evaluation_instances().shape == (8, 1)


@pytest.mark.parametrize(
    ("ask", "answer"),
    [
        (lambda task: task.in_region(np.zeros((1, 1))), "neither goals nor starts of task 'toy_reach' are positions"),
        (
            lambda task: task.in_cutout(np.zeros((1, 1)), 0.5),
            "--cutout needs a task whose goals or starts are positions; 'toy_reach' has none",
        ),
        (lambda task: task.fine_tuning_instances(), "has no fine-tuning instances"),
        (lambda task: task.tool_parts(np.zeros(1)), "does not define the parts of its tools"),
        (lambda task: task.script(), "has no script"),
    ],
)
def test_what_a_task_leaves_out_it_refuses(ask: Callable[[Task], object], answer: str, task: Task) -> None:
    class Bare(type(task)):  # type: ignore[misc]
        position_entries = ()
        in_cutout = Task.in_cutout
        fine_tuning_instances = Task.fine_tuning_instances

    with pytest.raises(UserError, match=answer):
        ask(Bare())
