"""The paper's grid of CMA-ES settings, searched on a budget by successive halving (Jamieson & Talwalkar 2016).

The grid has 972 settings. The first rung has a random subset that includes the paper's best; after every rung the best
third continues with three times the budget. The score of a setting is the return of CMA-ES's mean on the evaluation
instances.
"""

from __future__ import annotations

from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from io import StringIO
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeGuard

import numpy as np
from joblib import Parallel, delayed

from codesign_bench.config.profiles import DEFAULT_PROFILE
from codesign_bench.config.resolve import resolve
from codesign_bench.console import Log
from codesign_bench.errors import UserError
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.figures.source import Request
from codesign_bench.machine import available_cores
from codesign_bench.method import Problem, load_method
from codesign_bench.seeding import Streams, generator
from codesign_bench.storage.tables import Content, Form, read_table, write_table
from codesign_bench.studies.corl2023.learners import CMA_ES_SWEEP, Swept
from codesign_bench.task import load_task

if TYPE_CHECKING:
    import pandas as pd

FOLDER = "baseline_sweep"
TASK, METHOD = "catch_balls", "cma_es"
"""The paper does not name the task of its sweep. On push, 185 of 243 settings tie at the return of a tool that
touches nothing and no setting earns more, so push says nothing about settings."""
SEED = 0
"""Seed of the random subset of the grid, and of every run."""
REDUCTION = 3
"""A rung keeps a third of the settings and triples their budget."""

KEYS: dict[str, Swept] = {
    "popsize": CMA_ES_SWEEP.population_size,
    "sigma0": CMA_ES_SWEEP.sigma0,
    "center_learning_rate": CMA_ES_SWEEP.center_learning_rate,
    "covariance_learning_rate": CMA_ES_SWEEP.covariance_learning_rate,
    "rank_mu_learning_rate": CMA_ES_SWEEP.rank_mu_learning_rate,
    "rank_one_learning_rate": CMA_ES_SWEEP.rank_one_learning_rate,
}
"""Hyperparameter of the method -> values tested in the paper."""
COLUMNS = ("task", "rung", "budget", *KEYS, "paper_best", "env_steps", "return_mean", "kept")

FORM = Form(
    {name: Content.TEXT if name == "task" else Content.NUMBER for name in COLUMNS},
)
"""Of the table."""


@dataclass(frozen=True)
class Plan:
    """Size of the sweep under a profile."""

    settings: int
    """Number of settings of the first rung."""
    budget: int
    """Environment steps of the first rung."""


PLANS = {
    "quick": Plan(18, 10_000),
    "laptop": Plan(81, 50_000),
    "workstation": Plan(243, 100_000),
    "paper": Plan(972, 100_000),
}
"""By profile, from small to large; another profile has the plan of the default one."""


def settings_of(count: int) -> list[dict[str, float]]:
    """Return `count` settings of the grid, the paper's best first, the others at random."""
    grid = [dict(zip(KEYS, values, strict=True)) for values in product(*(swept.tested for swept in KEYS.values()))]
    best = {name: swept.best for name, swept in KEYS.items()}
    others = [setting for setting in grid if setting != best]
    order = generator(SEED, "settings").permutation(len(others))
    return [best, *(others[index] for index in order[: count - 1])]


def sweep_baseline(results: Path, profile: str, log: Log, task: str | None = None) -> pd.DataFrame:
    """Run the sweep and return its table, one row per setting and rung. Finished rungs in `results` are not run again.

    Args:
        results: results folder that has, or gets, the table.
        profile: size of the sweep.
        log: called with one line before every rung.
        task: name of the task; None: `TASK`, the one of the figure.

    Raises:
        UserError: the folder is not writable.
    """
    import pandas as pd

    plan_name = profile if profile in PLANS else DEFAULT_PROFILE
    task = task or TASK
    path = _path(results, task, plan_name)
    table = read_table(path, FORM)
    while not _is_finished(table):
        rung, alive, budget = _next_rung(table, PLANS[plan_name])
        log(f"{FOLDER}: {len(alive)} settings of {METHOD} with {budget:,} steps each on {task}")
        found = Parallel(n_jobs=available_cores())(delayed(_judge)(task, setting, budget) for setting in alive)
        order = np.argsort([-value for _, value in found], kind="stable")
        keep = set(order[: len(alive) // REDUCTION].tolist())
        rows = [
            {
                "task": task,
                "rung": rung,
                "budget": budget,
                **setting,
                "paper_best": int(all(setting[name] == swept.best for name, swept in KEYS.items())),
                "env_steps": env_steps,
                "return_mean": value,
                "kept": int(index in keep),
            }
            for index, (setting, (env_steps, value)) in enumerate(zip(alive, found, strict=True))
        ]
        ended = pd.DataFrame(rows, columns=list(COLUMNS))
        table = ended if table is None else pd.concat([table, ended], ignore_index=True)
        write_table(results, path, table)
    return table


def load_sweep(request: Request) -> pd.DataFrame:
    """Return the table of the largest finished sweep below the results folder.

    Raises:
        UserError: there is none.
    """
    for profile in reversed(PLANS):
        table = read_table(_path(request.results, TASK, profile), FORM)
        if _is_finished(table):
            return table
    raise UserError(f"no sweep in '{request.results}' yet")


def _path(results: Path, task: str, plan_name: str) -> Path:
    return results / FOLDER / f"{task}-{plan_name}.csv"


def _is_finished(table: pd.DataFrame | None) -> TypeGuard[pd.DataFrame]:
    """Return whether at most one setting is left."""
    return table is not None and table.loc[table["rung"] == table["rung"].max(), "kept"].sum() <= 1


def _next_rung(table: pd.DataFrame | None, plan: Plan) -> tuple[int, list[dict[str, float]], int]:
    """Return the number of the next rung, its settings, best first, and its budget in environment steps."""
    if table is None:
        return 0, settings_of(plan.settings), plan.budget
    last = table[table["rung"] == table["rung"].max()]
    kept = last[last["kept"] == 1].sort_values("return_mean", ascending=False, kind="stable")
    settings = [{name: float(setting[name]) for name in KEYS} for _, setting in kept.iterrows()]
    return int(last["rung"].iloc[0]) + 1, settings, int(last["budget"].iloc[0]) * REDUCTION


def _judge(task: str, setting: dict[str, float], budget: int) -> tuple[int, float]:
    """Train with one setting; return the steps taken and the final return."""
    method_class: Any = load_method(METHOD)
    config = replace(
        resolve(method_class, task, DEFAULT_PROFILE).method, **{**setting, "popsize": int(setting["popsize"])}
    )
    problem = Problem(load_task(task))
    method = method_class(problem, config, Streams(SEED))
    steps = 0
    # The library prints a warning where the rank-one rate is far above the rank-mu rate, as at many points of the grid.
    with redirect_stdout(StringIO()):
        while steps < budget:
            steps += method.train(budget - steps).env_steps
    return steps, float(evaluate(problem.task, method.policy()).returns.mean())
