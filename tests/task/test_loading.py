"""Tasks are found by name, and so are those that can be deployed on an arm."""

from __future__ import annotations

import pytest

from codesign_bench.errors import UserError
from codesign_bench.task import Task, deployable_tasks, deployment_of, load_task, task_names


def test_a_task_is_loaded_by_its_name() -> None:
    for name in task_names():
        assert isinstance(load_task(name), Task)
        assert load_task(name).name == name


def test_a_registered_task_is_known(toy: None) -> None:
    assert task_names()[-1] == "toy_reach"
    assert load_task("toy_reach").title == "Toy reach"


def test_an_unknown_task_is_answered_with_those_there_are() -> None:
    with pytest.raises(UserError, match="unknown task 'pull'; choose from: push, "):
        load_task("pull")


def test_tasks_on_an_arm_are_those_that_say_how(toy: None) -> None:
    deployable = deployable_tasks()
    assert set(deployable) < set(task_names())
    for name in deployable:
        task = load_task(name)
        assert deployment_of(task).trials.own.shape[1] == task.instance_space.size
    with pytest.raises(UserError, match="task 'toy_reach' has no deployment; choose from: ") as told:
        deployment_of(load_task("toy_reach"))
    assert str(told.value).endswith(", ".join(deployable))
