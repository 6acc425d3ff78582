"""Find tasks by name."""

from __future__ import annotations

from collections.abc import Iterable

from codesign_bench.console import Log, silent
from codesign_bench.errors import UnavailableError, UserError
from codesign_bench.registry import load, names, usable
from codesign_bench.task.robot import DeploymentSpec
from codesign_bench.task.task import Task


def task_names() -> tuple[str, ...]:
    """Return the names of all tasks, built-in and third-party."""
    return names("tasks")


def usable_tasks(given: Iterable[str], log: Log = silent) -> list[str]:
    """Return those of the given tasks that can be used in this Python; log the others, a line for each reason."""
    return usable(given, load_task, log)


def deployable_tasks() -> tuple[str, ...]:
    """Return the names of the tasks that can be deployed on an arm in this Python."""
    return tuple(name for name in usable_tasks(task_names()) if load_task(name).deployment is not None)


def deployment_of(task: Task) -> DeploymentSpec:
    """Return the deployment of a task.

    Raises:
        UserError: the task has none.
    """
    if task.deployment is None:
        raise UserError(f"task '{task.name}' has no deployment; choose from: {', '.join(deployable_tasks())}")
    return task.deployment


def load_task(name: str, *, plays: bool = True) -> Task:
    """Return the task `name`; with `plays=False` also one that can be described in this Python, but not played.

    Raises:
        UserError: there is no such task.
        UnavailableError: it cannot be used in this Python.
    """
    task: Task = load("tasks", name, Task)()
    if plays and task.missing:
        raise UnavailableError(task.missing, f"task '{name}'")
    return task
