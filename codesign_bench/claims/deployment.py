"""Rules about tools and policies on a simulated arm."""

from __future__ import annotations

import numpy as np
import pandas as pd

from codesign_bench.claims.claim import Rule
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import CONTRADICTED, SUPPORTED, Finding, Lacking
from codesign_bench.deployment.tables import GRID, OWN
from codesign_bench.studies.corl2023.real_robot import REAL_ROBOT

FEWEST_TOOLS = 4
"""The paper's number of tools, below which nothing is judged."""


def own_instance_solved(task: str, method: str) -> Rule:
    """Return the rule for "deployed policies succeed on the instance of `task` that their tool was designed for"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # trials are few and of one policy: no interval would say what other policies do
        rows = _trials(evidence, task, OWN)
        rates = rows.groupby("tool")["success"].mean()
        trials = int(rows.groupby("tool").size().min())
        if trials < REAL_ROBOT.trials:
            raise Lacking(f"{trials} trials of a tool of {task}; {REAL_ROBOT.trials} are needed")
        share = float((rates > 0.5).mean())
        n = f"{len(rates)} tools, {len(rows)} trials"
        return Finding(SUPPORTED if share == 1.0 else CONTRADICTED, share, n=n, note=_told(rows))

    return Rule(
        kind="own instance solved",
        statistic="share of tools that succeed in more than half of their trials on their own instance",
        words=f"supported if it is 1, contradicted if below, over at least {FEWEST_TOOLS} tools and "
        f"{REAL_ROBOT.trials} trials of each; no interval",
        needs=_needs(task, method),
        judge=judge,
    )


def no_tool_solves_the_grid(task: str, method: str) -> Rule:
    """Return the rule for "no tool solves the whole grid of starts of `task`"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # one start that a tool fails is enough
        rows = _trials(evidence, task, GRID)
        starts = int(rows.groupby("tool").size().min())
        if starts < int(np.prod(REAL_ROBOT.grid_shape)):
            raise Lacking(f"{starts} starts of the grid of {task} were tried with a tool; all are needed")
        solved = rows.pivot_table(index="tool", columns=["row", "column"], values="success") > 0
        solvable = solved.loc[:, solved.any()]
        if solvable.shape[1] == 0:
            raise Lacking(f"no tool solves any start of the grid of {task}")
        best = float(solvable.mean(axis=1).max())
        n = f"{len(solved)} tools, {solvable.shape[1]} of {solved.shape[1]} starts"
        return Finding(SUPPORTED if best < 1.0 else CONTRADICTED, best, n=n, note=_told(rows))

    return Rule(
        kind="no tool solves the grid",
        statistic="largest share that one tool solves of the starts of the grid that some tool solves",
        words=f"supported if it is below 1, contradicted if it is 1, over at least {FEWEST_TOOLS} tools and the whole "
        "grid; no interval",
        needs=_needs(task, method),
        judge=judge,
    )


def _trials(evidence: Evidence, task: str, kind: str) -> pd.DataFrame:
    """Return the trials of one kind and task.

    Raises:
        Lacking: there are too few tools.
    """
    frame = evidence.deployment
    rows = frame[(frame["task"] == task) & (frame["kind"] == kind)] if len(frame) else frame
    tools = rows["tool"].nunique() if len(rows) else 0
    if tools < FEWEST_TOOLS:
        raise Lacking(f"{tools} tools of {task} were deployed; {FEWEST_TOOLS} are needed")
    return rows


def _told(rows: pd.DataFrame) -> str:
    """Return the successes by tool in words."""
    counts = rows.groupby("tool")["success"].agg(["sum", "size"])
    return "successes by tool: " + ", ".join(f"{won}/{all_}" for won, all_ in counts.itertuples(index=False))


def _needs(task: str, method: str) -> tuple[str, ...]:
    cell = f"{{results}}/{task}/{method}/default/seed-00"
    return (f"codesign-bench deploy --policy {cell} --protocol --out {{results}}",)
