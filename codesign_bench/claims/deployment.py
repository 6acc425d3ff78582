"""Rules about tools and policies on a simulated arm."""

from __future__ import annotations

import numpy as np
import pandas as pd

from codesign_bench import stats
from codesign_bench.claims.claim import Rule
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import CONTRADICTED, SUPPORTED, Finding, InsufficientData, above
from codesign_bench.deployment.tables import GRID, OWN, SEED, SOLVED_IN_TRAINING

FEWEST_SEEDS = 5
"""Policies that must have been deployed before their tools say something of the method (ours)."""
MOSTLY = 0.5
"""Share of trials above which a tool succeeds, and of tools above which the arm keeps them (ours)."""


def arm_keeps_what_training_solves(task: str, method: str, *, tools: int, trials: int) -> Rule:
    """Return the rule for "policies succeed on the arm on the instance of `task` that their tool was designed for".

    An instance that a policy does not solve in training physics says nothing about the arm. At least
    `FEWEST_SEEDS` policies, `tools` tools of each and `trials` trials of each tool are needed.
    """

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # nothing is drawn
        rows = _trials(evidence, task, OWN, tools)
        if SOLVED_IN_TRAINING not in rows.columns or rows[SOLVED_IN_TRAINING].isna().any():
            raise InsufficientData(
                f"no trial of {task} says whether its policy solves the instance in training physics"
            )
        seeds = rows[SEED].nunique()
        if seeds < FEWEST_SEEDS:
            raise InsufficientData(f"policies of {seeds} seeds of {task} were deployed; {FEWEST_SEEDS} are needed")
        made = int(rows.groupby([SEED, "tool"]).size().min())
        if made < trials:
            raise InsufficientData(f"{made} trials of a tool of {task}; {trials} are needed")
        solved = rows[rows[SOLVED_IN_TRAINING] > 0]
        rates = solved.groupby([SEED, "tool"])["success"].mean()
        if not len(rates):
            raise InsufficientData(f"no deployed policy solves its own instances of {task} in training physics")
        found = stats.proportion_test(int((rates > MOSTLY).sum()), len(rates), MOSTLY)
        n = f"{len(rates)} of {rows.groupby([SEED, 'tool']).ngroups} tools solved in training, {seeds} seeds"
        return Finding(above(found, MOSTLY), found.value, found.low, found.high, n, _told(solved), found.p)

    return Rule(
        kind="the arm keeps what training solves",
        statistic="of the tools that solve their own instance in training physics, share that succeed in more than "
        "half of their trials on the arm",
        words=f"over at least {FEWEST_SEEDS} policies, {tools} tools of each and {trials} trials of each tool, "
        f"supported if the exact 95 % interval (Clopper and Pearson) is above {MOSTLY:g}, contradicted if below "
        f"{MOSTLY:g}",
        needs=_needs(task, method, FEWEST_SEEDS),
        judge=judge,
    )


def no_tool_solves_the_grid(task: str, method: str, *, tools: int, starts: int) -> Rule:
    """Return the rule for "no tool solves the whole grid of starts of `task`".

    At least `tools` tools and `starts` starts of the grid are needed.
    """

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # one failed start per tool is enough: nothing is estimated from a sample
        rows = _trials(evidence, task, GRID, tools)
        rows = rows[rows[SEED] == rows[SEED].min()]  # the tools of one policy, as in the paper
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


def _needs(task: str, method: str, seeds: int = 1) -> tuple[str, ...]:
    cells = (f"{{results}}/{task}/{method}/default/seed-{{seed[{index}]:02d}}" for index in range(seeds))
    return tuple(f"codesign-bench deploy --policy {cell} --protocol --out {{results}}" for cell in cells)
