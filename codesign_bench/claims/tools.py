"""Rules about tools and goals.

Shapes: `N` seeds.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from codesign_bench import stats
from codesign_bench.claims.claim import Rule
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import CONTRADICTED, SUPPORTED, Finding, InsufficientData, above, reason
from codesign_bench.claims.statistics import T_INTERVAL, seeds_of
from codesign_bench.evaluation.sensitivity import measure_missing

GOAL_SHARE = 0.1
"""Tools vary with the goal if goals explain more than this fraction of their variance (ours)."""
FLOOR = 0.01
"""Standard deviation over goals, in widths of the ranges, below which tools differ only by rounding (ours)."""
FEWEST_TOOLS = 50
"""Fewest tried tools for a statement about tools in general (ours)."""


def tools_vary(task: str, method: str, needs: tuple[str, ...]) -> Rule:
    """Return the rule for "`method` designs different tools for different goals of `task`"; see `Rule.needs`."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # nothing is drawn
        rows = evidence.instances(task, method)
        if task not in evidence.design_widths:
            raise InsufficientData(f"the task '{task}' is unknown, or cannot be used in this Python")
        shares = goal_shares(rows, evidence.design_widths[task])
        found = stats.one_sample_t(shares, GOAL_SHARE)
        low, high = np.clip([found.low, found.high], 0.0, 1.0).tolist()
        told = reason(found, GOAL_SHARE)
        return Finding(above(found, GOAL_SHARE), found.value, low, high, seeds_of(shares), told, found.p)

    return Rule(
        kind="goals tell tools apart",
        statistic="variance of designs over goals, as a share of their variance over goals and seeds",
        words=f"supported if {T_INTERVAL}, cut off at 0 and 1, is above {GOAL_SHARE:g}, contradicted if below "
        f"{GOAL_SHARE:g}; a spread over goals below {FLOOR:.0%} of the ranges counts as none",
        needs=needs,
        judge=judge,
    )


def goal_shares(rows: pd.DataFrame, widths: Mapping[str, float]) -> np.ndarray:
    """Return (N,): each seed's variance of designs over goals, divided by the variance over all goals and seeds.

    Variances are summed over design parameters, each in units of the width of its range; below `FLOOR` the share is 0.

    Args:
        rows: one row per seed and goal, with the columns named in `widths`.
        widths: column of a design parameter -> width of its range.
    """
    columns = [column for column, width in widths.items() if width > 0.0]
    # Lengths and angles have different units; in widths of their ranges they can be added.
    units = rows[columns] / [widths[column] for column in columns]
    total = float(units.var(ddof=0).sum())
    # Seeds that agree on one tool for all goals have no variance within seeds; seeds that find different but constant
    # tools have only variance between them, which the total contains and this does not.
    within = units.groupby(rows["seed"]).var(ddof=0).sum(axis=1).to_numpy()
    within = np.where(within < FLOOR**2, 0.0, within)
    return within / total if total > 0.0 else np.zeros_like(within)


def no_single_tool(task: str, needs: tuple[str, ...]) -> Rule:
    """Return the rule for "no single tool solves every goal of `task`"; see `Rule.needs`."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # one goal that a tool fails is enough: nothing is estimated from a sample
        frame = evidence.sensitivity
        rows = frame[frame["task"] == task] if len(frame) else frame
        if rows.empty:
            raise InsufficientData(f"the design sensitivity of {task} is not measured")
        solved = rows.pivot(index="tool", columns="goal", values="success") > 0
        # A goal that no tool solves says nothing about one tool against several.
        solvable = solved.loc[:, solved.any()]
        if len(solved) < FEWEST_TOOLS or solvable.shape[1] < 2:
            raise InsufficientData(
                f"{len(solved)} tools and {solvable.shape[1]} goals that any of them solves are too few"
            )
        best = float(solvable.mean(axis=1).max())
        n = f"{len(solved)} tools, {solvable.shape[1]} of {solved.shape[1]} goals"
        return Finding(SUPPORTED if best < 1.0 else CONTRADICTED, best, n=n, note="one controller, written by hand")

    return Rule(
        kind="no single tool",
        statistic="largest share that one tool solves of the goals that some tool solves",
        words=f"supported if it is below 1, contradicted if it is 1, over at least {FEWEST_TOOLS} tools; no interval",
        needs=needs,
        judge=judge,
        measure=lambda results, log: measure_missing(results, [task], log),
    )
