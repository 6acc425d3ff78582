"""Find tasks by name."""

from __future__ import annotations

from codesign_bench.registry import load, names
from codesign_bench.task.task import Task


def task_names() -> tuple[str, ...]:
    """Return the names of all tasks, built-in and third-party."""
    return names("tasks")


def deployable_tasks() -> tuple[str, ...]:
    """Return the names of the tasks that can be deployed on an arm."""
    base = Task.make_deployed_simulator
    return tuple(name for name in task_names() if type(load_task(name)).make_deployed_simulator is not base)


def load_task(name: str) -> Task:
    """Return the task `name`.

    Raises:
        UserError: there is no such task.
    """
    task: Task = load("tasks", name, Task)()
    return task
