"""Every resolved hyperparameter of every method on the paper's tasks, for several profiles."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from codesign_bench.config.resolve import resolve
from codesign_bench.errors import UserError
from codesign_bench.figures.source import Request, tasks_in
from codesign_bench.method import load_method
from codesign_bench.studies.corl2023.members import METHODS, TASKS
from codesign_bench.studies.corl2023.scenes import SCENES

if TYPE_CHECKING:
    import pandas as pd

PROFILES = ("paper", "laptop")
SCENE = "scene"
"""Used instead of a method for the scene's rows of the paper's tables, which no profile changes."""
SCENE_SOURCE = "paper, table of {task}"
SCIENTIFIC_BELOW = 1e-3
"""Smaller numbers are written as 2e-5, as in the paper."""


def hyperparameters(methods: Iterable[str], tasks: Iterable[str] = tuple(SCENES)) -> pd.DataFrame:
    """Return one row per task, method and hyperparameter, in the order of their definition.

    Returns:
        Columns task, method (`SCENE` for the scene's own, which come first), label, name, then for each of `PROFILES`
        its value as text and `<profile>_source`.

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
    return hyperparameters(METHODS, [task for task in TASKS if task in present])


def as_text(value: Any) -> str:
    """Return a value as the paper prints it: 2e-5, 0.01, 50000, True, (64, 64, 64)."""
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"({', '.join(as_text(item) for item in value)})"
    if isinstance(value, float) and 0.0 < abs(value) < SCIENTIFIC_BELOW:
        digits, exponent = f"{value:e}".split("e")
        return f"{float(digits):g}e{int(exponent)}"
    return str(value)


def _scene_rows(task: str) -> Iterator[dict[str, str]]:
    scene = SCENES[task]
    for field in fields(scene):
        text, source = as_text(getattr(scene, field.name)), SCENE_SOURCE.format(task=task)
        both = {key: entry for profile in PROFILES for key, entry in ((profile, text), (f"{profile}_source", source))}
        yield {"task": task, "method": SCENE, "label": SCENE, "name": field.name, **both}


def _method_rows(method: Any, task: str) -> Iterator[dict[str, str]]:
    resolved = {profile: resolve(method, task, profile).stored().method for profile in PROFILES}
    for name in resolved[PROFILES[0]]:
        entries = {}
        for profile, values in resolved.items():
            entries[profile] = as_text(values[name].value)
            entries[f"{profile}_source"] = values[name].source
        yield {"task": task, "method": method.name, "label": method.label, "name": name, **entries}
