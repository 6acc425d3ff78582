"""Save a cell's final policy and load it again, without pickle."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from codesign_bench.config.resolve import METHOD, method_config
from codesign_bench.errors import UserError
from codesign_bench.method import Array, Policy, load_method
from codesign_bench.storage.checkpoint import load_arrays, save_arrays
from codesign_bench.storage.results import CELL_FILE, DONE, POLICY_FILE, read_cell
from codesign_bench.task import Task, load_task


def save_policy(folder: Path, policy: Policy, header: dict[str, Any]) -> None:
    """Write the tensors of `policy` into a cell's folder; `header` says whose they are."""
    save_arrays(folder / POLICY_FILE, policy.tensors(), header)


def load_policy(folder: str | Path) -> Policy:
    """Return the final policy of the cell in `folder`; `design(observation)` and `act(observation)` take its means.

    Raises:
        UserError: the folder is no finished cell, or its files are damaged or do not fit this version.
    """
    folder = Path(folder)
    cell = read_cell(folder)
    if cell is None:
        raise UserError(f"'{folder}' is no cell's folder: it has no {CELL_FILE}")
    tensors, path = policy_tensors(folder), folder / POLICY_FILE
    method_class = load_method(cell["method"])
    config = method_config(method_class.config_class, cell["config"][METHOD])
    try:
        return method_class.make_policy(load_task(cell["task"]), config, tensors)
    except (KeyError, ValueError, RuntimeError) as error:
        raise UserError(f"{path} does not fit method '{cell['method']}' of this version: {error}") from error


def policy_and_task(folder: Path, name: str | None) -> tuple[Policy, Task]:
    """Return the final policy of the cell in `folder` and its task.

    Raises:
        UserError: it is no finished cell, or was trained on another task than `name`.
    """
    policy = load_policy(folder)
    trained_on = (read_cell(folder) or {})["task"]
    if name not in (None, trained_on):
        raise UserError(f"--policy {folder}: trained on '{trained_on}', not on '{name}'")
    return policy, load_task(trained_on)


def policy_tensors(folder: Path) -> dict[str, Array]:
    """Return the tensors of the final policy of the cell in `folder`.

    Raises:
        UserError: the folder is no finished cell, or the file is damaged.
    """
    cell, path = read_cell(folder), folder / POLICY_FILE
    if cell is None:
        raise UserError(f"'{folder}' is no cell's folder: it has no {CELL_FILE}")
    try:
        return load_arrays(path)[0]
    except FileNotFoundError:
        state = "its policy file is missing" if cell["status"] == DONE else f"its status is '{cell['status']}'"
        raise UserError(f"'{folder}' holds no final policy: {state}") from None
    except ValueError as error:
        raise UserError(f"cannot load {path}: {error}") from error
