"""Rules about tools and policies on a simulated arm."""

from __future__ import annotations

import numpy as np
import pandas as pd

from codesign_bench.claims.claim import Rule
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import CONTRADICTED, SUPPORTED, Finding, InsufficientData
from codesign_bench.deployment.tables import GRID, OWN


def own_instance_solved(task: str, method: str, *, tools: int, trials: int) -> Rule:
    """Return the rule for "deployed policies succeed on the instance of `task` that their tool was designed for".

    At least `tools` tools and `trials` trials of each are needed.
    """

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # few trials of one policy: an interval would say nothing about other policies
        rows = _trials(evidence, task, OWN, tools)
        rates = rows.groupby("tool")["success"].mean()
        made = int(rows.groupby("tool").size().min())
        if made < trials:
            raise InsufficientData(f"{made} trials of a tool of {task}; {trials} are needed")
        share = float((rates > 0.5).mean())
        n = f"{len(rates)} tools, {len(rows)} trials"
        return Finding(SUPPORTED if share == 1.0 else CONTRADICTED, share, n=n, note=_told(rows))

    return Rule(
        kind="own instance solved",
        statistic="share of tools that succeed in more than half of their trials on their own instance",
        words=f"supported if it is 1, contradicted if below, over at least {tools} tools and {trials} trials of "
        "each; no interval",
        needs=_needs(task, method),
        judge=judge,
    )


def no_tool_solves_the_grid(task: str, method: str, *, tools: int, starts: int) -> Rule:
    """Return the rule for "no tool solves the whole grid of starts of `task`".

    At least `tools` tools and `starts` starts of the grid are needed.
    """

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # one failed start per tool is enough: nothing is estimated from a sample
        rows = _trials(evidence, task, GRID, tools)
        tried = int(rows.groupby("tool").size().min())
        if tried < starts:
            raise InsufficientData(f"{tried} starts of the grid of {task} were tried with a tool; {starts} are needed")
        solved = rows.pivot_table(index="tool", columns=["row", "column"], values="success") > 0
        # A start that no tool solves says nothing about one tool against several.
        solvable = solved.loc[:, solved.any()]
        if solvable.shape[1] == 0:
            raise InsufficientData(f"no tool solves any start of the grid of {task}")
        best = float(solvable.mean(axis=1).max())
        n = f"{len(solved)} tools, {solvable.shape[1]} of {solved.shape[1]} starts"
        return Finding(SUPPORTED if best < 1.0 else CONTRADICTED, best, n=n, note=_told(rows))

    return Rule(
        kind="no tool solves the grid",
        statistic="largest share that one tool solves of the starts of the grid that some tool solves",
        words=f"supported if it is below 1, contradicted if it is 1, over at least {tools} tools and the whole "
        "grid; no interval",
        needs=_needs(task, method),
        judge=judge,
    )


def _trials(evidence: Evidence, task: str, kind: str, fewest: int) -> pd.DataFrame:
    """Return the trials of one kind and task, of at least `fewest` tools.

    Raises:
        InsufficientData: there are too few tools.
    """
    frame = evidence.deployment
    rows = frame[(frame["task"] == task) & (frame["kind"] == kind)] if len(frame) else frame
    tools = rows["tool"].nunique() if len(rows) else 0
    if tools < fewest:
        raise InsufficientData(f"{tools} tools of {task} were deployed; {fewest} are needed")
    return rows


def _told(rows: pd.DataFrame) -> str:
    """Return the successes by tool in words."""
    counts = rows.groupby("tool")["success"].agg(["sum", "size"])
    return "successes by tool: " + ", ".join(f"{won}/{all_}" for won, all_ in counts.itertuples(index=False))


def _needs(task: str, method: str) -> tuple[str, ...]:
    cell = f"{{results}}/{task}/{method}/default/seed-00"
    return (f"codesign-bench deploy --policy {cell} --protocol --out {{results}}",)
