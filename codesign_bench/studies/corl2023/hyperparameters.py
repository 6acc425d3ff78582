"""What runs on the paper's tasks beside what its tables print.

Scenes as tasks define them, methods as configurations resolve them, profile beside profile.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from codesign_bench.config.resolve import resolve
from codesign_bench.errors import UserError
from codesign_bench.figures.source import Request, tasks_in
from codesign_bench.method import load_method
from codesign_bench.studies.corl2023.learners import LEARNERS
from codesign_bench.studies.corl2023.members import METHODS, OURS, TASKS
from codesign_bench.studies.corl2023.scenes import SCENES, UNUSED
from codesign_bench.task import load_task, usable_tasks
from codesign_bench.task.scene import Constant, by_row

if TYPE_CHECKING:
    import pandas as pd

PROFILES = ("paper", "laptop")
SCENE = "scene"
"""In place of a method: the scene, which no profile changes."""
NOT_USED = "not used"
DIFFERS = "differs"
"""Marks a value that is not the printed one."""
SCIENTIFIC_BELOW = 1e-3
"""Smaller numbers are written as 2e-5, as in the paper."""


def hyperparameters(methods: Iterable[str], tasks: Iterable[str] = tuple(SCENES)) -> pd.DataFrame:
    """Return one row per task, method and hyperparameter, in the order of their definition.

    Returns:
        Columns task, method (`SCENE` for the scene's own, which come first), label, name, printed_value (what the
        paper's table of the task prints; empty: no such row), then for each of `PROFILES` the value that runs, as text,
        `<profile>_source`, and `<profile>_differs` (`DIFFERS` where it is not the printed one).

    Raises:
        UserError: an unknown method, or no task.
    """
    import pandas as pd

    tasks, chosen = list(tasks), [load_method(name) for name in methods]
    if not tasks:
        raise UserError("the paper has no tables for these tasks")
    rows: list[dict[str, str]] = []
    for task in tasks:
        rows += _scene_rows(task)
        for method in chosen:
            rows += _method_rows(method, task)
    return pd.DataFrame(rows)


def hyperparameters_of_results(request: Request) -> pd.DataFrame:
    """Return the settings of the paper's methods on its tasks in the results; on all its tasks if the figure was named.

    Raises:
        UserError: the results have none of the paper's tasks.
    """
    present = TASKS if request.named else tasks_in(request.results)
    return hyperparameters(METHODS, usable_tasks([task for task in TASKS if task in present], request.log))


def as_text(value: Any) -> str:
    """Return a value as the paper prints it: 2e-5, 0.01, 50000, True, (64, 64, 64)."""
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"({', '.join(as_text(item) for item in value)})"
    if isinstance(value, float):
        value = float(f"{value:.12g}")  # what sums of constants leave in the last digits is no part of the value
    if isinstance(value, float) and 0.0 < abs(value) < SCIENTIFIC_BELOW:
        digits, exponent = f"{value:e}".split("e")
        return f"{float(digits):g}e{int(exponent)}"
    return str(value)


def used_in_scenes(task: str) -> dict[str, Constant]:
    """Return the constants that a task uses, by the row of the paper's table of its scene that they stand for."""
    rows = by_row(load_task(task).scene)
    return {field.name: rows[field.name] for field in fields(SCENES[task]) if field.name in rows}


def same_value(printed: Any, used: Any) -> bool:
    """Return whether numbers are the printed ones; one number stands for as many equal ones as are printed."""
    one, other = np.asarray(printed), np.asarray(used)
    if other.ndim == 0:
        return bool((one == other).all())
    return one.shape == other.shape and bool((one == other).all())


def _scene_rows(task: str) -> Iterator[dict[str, str]]:
    scene, used = SCENES[task], used_in_scenes(task)
    for field in fields(scene):
        printed, differs = getattr(scene, field.name), ""
        if field.name in used:
            constant = used[field.name]
            value, source = as_text(_plain(constant.value)), constant.source
            differs = "" if same_value(printed, constant.value) else DIFFERS
        else:
            value, source = NOT_USED, UNUSED[f"{task}: {field.name}"]
        row = {"task": task, "method": SCENE, "label": SCENE, "name": field.name, "printed_value": as_text(printed)}
        for profile in PROFILES:
            row |= {profile: value, f"{profile}_source": source, f"{profile}_differs": differs}
        yield row


def _method_rows(method: Any, task: str) -> Iterator[dict[str, str]]:
    resolved = {profile: resolve(method, task, profile).stored().method for profile in PROFILES}
    printed = asdict(LEARNERS[task]) if method.name == OURS else {}
    for name in resolved[PROFILES[0]]:
        told = as_text(printed[name]) if name in printed else ""
        row = {"task": task, "method": method.name, "label": method.label, "name": name, "printed_value": told}
        for profile, values in resolved.items():
            value = as_text(values[name].value)
            row |= {profile: value, f"{profile}_source": values[name].source}
            row[f"{profile}_differs"] = DIFFERS if told and value != told else ""
        yield row


def _plain(value: Any) -> Any:
    return tuple(value.tolist()) if isinstance(value, np.ndarray) else value
