"""Save and load a cell's final policy, without pickle."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from codesign_bench.cell.axes import axis_named
from codesign_bench.config.resolve import method_config
from codesign_bench.config.run_settings import RunSettings
from codesign_bench.errors import ChangedTaskError, UnavailableError, UnknownNameError, UserError
from codesign_bench.method import Array, Method, Policy, Problem, load_method
from codesign_bench.storage.arrays import load_arrays, save_arrays
from codesign_bench.storage.cells import StoredCell, open_cell
from codesign_bench.storage.files import reason_of
from codesign_bench.storage.layout import POLICY_FILE
from codesign_bench.storage.reading import DamagedFile, UnreadableFile
from codesign_bench.storage.records import CELL_FILE
from codesign_bench.task import Task, load_task

MOST_LAYERS, WIDEST, LARGEST_LAYER = 64, 2**16, 2**26
"""Limits of the networks in a cell file: number of layers, width of a layer, weights between two."""


def save_policy(folder: Path, policy: Policy, header: dict[str, Any]) -> None:
    """Write the tensors of `policy` to a cell's folder; `header` names task and method."""
    save_arrays(folder / POLICY_FILE, policy.tensors(), header)


def load_policy(folder: str | Path) -> Policy:
    """Return the final policy of the cell in `folder`; `design(observation)` and `act(observation)` return its means.

    The cell may be in an archive or in the shipped results: `mine.zip/push/...`, `reference/push/...`.

    Raises:
        ChangedTaskError: its task has changed since.
        UserError: the folder has no finished cell, or its files are damaged or incompatible with this version.
    """
    return policy_of(open_cell(folder))


def policy_of(cell: StoredCell) -> Policy:
    """Return the final policy of a cell.

    Raises:
        ChangedTaskError: its task has changed since: its version, or the size of its observation.
        UserError: it is not finished, or its files are damaged or incompatible with this version.
    """
    task, method_class = members_of(cell)
    tensors, record, path = policy_tensors(cell), cell.record, cell.folder / POLICY_FILE
    _check_widths(cell)
    config = method_config(method_class.config_class, record.config.method)
    try:
        return method_class.make_policy(task, config, tensors)
    except ChangedTaskError as error:
        again = f"codesign-bench run --task {record.task} --method {record.method}"
        raise ChangedTaskError(f"{path} was {error}; train it again, into another folder: {again}") from error
    except (KeyError, ValueError, TypeError, IndexError, AttributeError, RuntimeError, MemoryError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise UserError(f"{path} is incompatible with method '{record.method}' of this version: {reason}") from error


def misfit(cell: StoredCell) -> str:
    """Return why a cell's final policy cannot act on its task as it is now, or in this Python, or "" if it can.

    Raises:
        UserError: the cell is not finished, or its files are damaged or otherwise incompatible with this version.
    """
    try:
        policy_of(cell)
    except (ChangedTaskError, UnavailableError, UnknownNameError) as error:
        return str(error)
    return ""


def policy_and_task(folder: Path, name: str | None) -> tuple[Policy, Task]:
    """Return the final policy of the cell in `folder` and its task.

    Raises:
        UserError: it is not a finished cell, was trained on a task other than `name`, or its task has changed since.
    """
    cell = open_cell(folder)
    trained_on = cell.record.task
    if name not in (None, trained_on):
        raise UserError(f"--policy {folder}: trained on '{trained_on}', not on '{name}'")
    return policy_of(cell), members_of(cell)[0]


def members_of(cell: StoredCell) -> tuple[Task, type[Method[Any]]]:
    """Return task and method of a cell.

    Raises:
        UnavailableError: one of them cannot be used in this Python.
        UnknownNameError: no task or method has the stored name; the message names the cell's file.
    """
    try:
        return load_task(cell.record.task), load_method(cell.record.method)
    except UnknownNameError as error:
        raise UnknownNameError(f"{cell.folder / CELL_FILE}: {error}") from error


def problem_of(cell: StoredCell) -> Problem:
    """Return the learning problem of a cell, with its reward and its evaluation instances.

    Raises:
        UserError: an axis of its variant is unknown, or its settings are incompatible with this version.
    """
    record = cell.record
    run: RunSettings = method_config(RunSettings, record.config.run)
    problem = Problem(members_of(cell)[0], validation=not cell.is_reported)
    for axis, value in record.variant:
        problem = axis_named(axis).problem(problem, value, run)
    return problem


def _check_widths(cell: StoredCell) -> None:
    """Check that a cell's settings ask for no network that could not be in a policy's file, before it is allocated.

    Raises:
        DamagedFile: a list of widths is too long, or its layers are too large.
    """
    for name, (value, _) in cell.record.config.method.items():
        widths = value if isinstance(value, list) and all(type(width) is int for width in value) else []
        layers = [before * after for before, after in pairwise(widths)]
        if len(widths) > MOST_LAYERS or max([*widths, 0]) > WIDEST or max([*layers, 0]) > LARGEST_LAYER:
            raise DamagedFile(cell.folder / CELL_FILE, f"'{name}' asks for a network that no policy has")


def policy_tensors(cell: StoredCell) -> dict[str, Array]:
    """Return the tensors of a cell's final policy.

    Raises:
        ChangedTaskError: the task has another version now.
        UserError: the cell is not finished, or the file is damaged.
    """
    record, now = cell.record, members_of(cell)[0].version
    if record.task_version != now:
        raise ChangedTaskError(
            f"'{cell.folder}' was trained on version {record.task_version} of task '{record.task}', which is now at "
            f"version {now}: train it again, or use the release that made it"
        )
    path = cell.folder / POLICY_FILE
    try:
        tensors = load_arrays(path)[0]
    except FileNotFoundError:
        state = "its policy file is missing" if cell.is_done else f"its status is '{cell.status}'"
        raise UserError(f"'{cell.folder}' has no final policy: {state}") from None
    except ValueError as error:
        raise DamagedFile(path, str(error)) from error
    except OSError as error:
        raise UnreadableFile(path, reason_of(error)) from error
    for name, tensor in tensors.items():
        if (np.isnan(tensor) | np.isposinf(tensor)).any():  # the logarithm of a standard deviation of 0 is -inf
            raise DamagedFile(path, f"'{name}' has values that are not numbers")
    return tensors
