"""Design sensitivity: how much the tool matters with one scripted controller, many tools and many goals.

A task's script controls every tool on every goal, without learning. If the design matters, tools differ widely and no
tool solves every goal. The tables are next to the cells, one per task, and are measured once.

Shapes: `K` tools, `G` goals (evaluation instances), `B` episodes, `I` instance, `D` design.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from joblib import Parallel, delayed

from codesign_bench.console import Log
from codesign_bench.errors import UserError
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.machine import available_cores
from codesign_bench.seeding import generator
from codesign_bench.storage.measurements import DESIGN_SENSITIVITY, usable
from codesign_bench.storage.reading import is_there
from codesign_bench.storage.tables import write_table
from codesign_bench.task import EVALUATION_SEED, Floats, Task, load_task, task_names
from codesign_bench.task.behaviours import GivenDesigns
from codesign_bench.task.episodes import Episodes
from codesign_bench.task.play import first_observations

if TYPE_CHECKING:
    import pandas as pd

FOLDER = "design_sensitivity"
RANDOM_TOOLS = 200
GOALS = 16
"""Number of goals: the first of the task's evaluation instances."""
EPISODES_AT_ONCE = 64

RANDOM, SCRIPTED = "random", "scripted"
"""Kinds of tools: uniform in the design space, or designed by the script for one of the goals."""

COLUMNS = ("task", "tool", "kind", "goal", "own", "outcome", "return", "success", "outcome_name", "outcome_unit")
"""`own` marks a scripted tool on the goal for which it was designed."""


def tools_of(task: Task, goals: Floats, random_tools: int = RANDOM_TOOLS) -> Floats:
    """Return (K, D) normalised designs: random ones, then the script's design for each of `goals` (G, I)."""
    rng = generator(EVALUATION_SEED, f"tools for {task.name}")
    random = rng.uniform(-1.0, 1.0, size=(random_tools, task.design_space.size))
    scripted = np.asarray(task.script().design(first_observations(Episodes(task, len(goals)), goals)), dtype=np.float64)
    return np.concatenate([random, scripted])


def measure(name: str, random_tools: int = RANDOM_TOOLS, goals: int = GOALS, jobs: int = 1) -> pd.DataFrame:
    """Return the outcome of every tool on every goal of the task `name`, one row each, with `COLUMNS`.

    Raises:
        UserError: the task has no script or no outcome.
    """
    import pandas as pd

    task = load_task(name)
    if task.outcome is None:
        raise UserError(f"task '{name}' has no outcome")
    instances = task.evaluation_instances()[:goals]
    designs = tools_of(task, instances, random_tools)
    tool, goal = (index.ravel() for index in np.indices((len(designs), len(instances))))
    outcome, returns, success = play_tools(task, designs[tool], instances[goal], jobs)
    return pd.DataFrame(
        {
            "task": name,
            "tool": tool,
            "kind": np.where(tool < random_tools, RANDOM, SCRIPTED),
            "goal": goal,
            "own": (tool - random_tools == goal).astype(int),
            "outcome": outcome,
            "return": returns,
            "success": success.astype(int),
            "outcome_name": task.outcome.name,
            "outcome_unit": task.outcome.unit,
        },
        columns=list(COLUMNS),
    )


def play_tools(task: Task, designs: Floats, instances: Floats, jobs: int = 1) -> tuple[Floats, Floats, Floats]:
    """Return outcome, return and success, each (B,), of one episode per row under the script's controller.

    Args:
        task: has a script.
        designs: (B, D) normalised.
        instances: (B, I) in the instance space's units.
        jobs: processes that play side by side; the numbers do not depend on it.

    Raises:
        UserError: the task has no script.
    """
    parts = np.array_split(np.arange(len(designs)), -(-len(designs) // min(EPISODES_AT_ONCE, task.max_slots)))
    results = Parallel(n_jobs=jobs)(delayed(_play)(task, designs[part], instances[part]) for part in parts)
    outcome, returns, success = (np.concatenate(values) for values in zip(*results, strict=True))
    return outcome, returns, success


def measure_missing(results: Path, tasks: Iterable[str], log: Log) -> None:
    """Measure the tables of `tasks` that are missing below `results`; tasks that cannot be measured are skipped.

    Raises:
        UserError: the folder is not writable.
    """
    for name in tasks:
        path = _path(results, name)
        if is_there(path):  # also if it is damaged: what was measured is never overwritten
            continue
        log(f"{FOLDER}: playing {RANDOM_TOOLS} random tools on {GOALS} goals of {name}; kept in {path}")
        try:
            table = measure(name, jobs=available_cores())
        except UserError as error:
            log(f"{FOLDER}: {name} left out: {error}")
            continue
        write_table(results, path, table)


def load_sensitivity(results: Path) -> pd.DataFrame:
    """Return the tables of all tasks below `results`.

    Raises:
        UserError: there is none.
    """
    import pandas as pd

    tables = [table for name in task_names() if (table := stored_table(results, name)) is not None]
    if not tables:
        raise UserError(f"not measured yet; measure it with: codesign-bench plot {FOLDER} --results {results}")
    return pd.concat(tables, ignore_index=True)


def stored_table(results: Path, task_name: str) -> pd.DataFrame | None:
    """Return the table of one task, or None if there is none that can be used."""
    return usable(_path(results, task_name), DESIGN_SENSITIVITY)


def _path(results: Path, task_name: str) -> Path:
    return results / FOLDER / f"{task_name}.csv"


def _play(task: Task, designs: Floats, instances: Floats) -> tuple[Floats, Floats, Floats]:
    """Return outcome, return and success of one episode per row."""
    evaluation = evaluate(task, GivenDesigns(designs, task.script()), instances=instances)
    return evaluation.outcomes, evaluation.returns, evaluation.successes.astype(np.float64)
