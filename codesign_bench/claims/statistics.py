"""Shared by several kinds of rules.

Shapes: `N` seeds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from codesign_bench import stats
from codesign_bench.cell.variant import DEFAULT, Variant
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import InsufficientData
from codesign_bench.storage.reference_points import references

T_INTERVAL = "the 95 % t interval over seeds"
WELCH_INTERVAL = "the 95 % Welch interval"
LEAST_SHARE = 0.05
"""Smallest effect that counts, as a share of its scale: with less, one would not choose a method for it (ours)."""
EFFECT_SCALE = (
    "the task's scale (best known minus idle return; without reference points, the largest mean return of a method)"
)
"""Words for `effect_scale`."""
BUDGET_TOLERANCE = 0.1
"""Budgets count as equal up to this relative difference in environment steps, since batches overshoot slightly."""
FEWEST_LEVELS = 3
"""Fewest fractions or coefficients for a trend."""


def run_command(method: str, task: str, seeds: int, more: str = "") -> str:
    """Return the command that runs cells, with the placeholders of `Rule.needs`.

    Finished cells are skipped, so claims about one task may share a command with `method` "all".
    """
    chosen = f"--seeds {{seeds[{seeds}]}}"
    return f"codesign-bench run --method {method} --task {task}{more} {chosen}{{profile}} --out {{results}}"


def effect_scale(evidence: Evidence, task: str, *sides: tuple[str, Variant]) -> float:
    """Return the difference of returns that counts as 1 on a task.

    It is the range of normalised scores, the best known return minus that of an idle policy with random tools, if the
    results have both reference points. Otherwise it is the largest absolute mean final return of a method.

    Args:
        evidence: what is known.
        task: name of the task.
        sides: what is compared, each (method, variant); counts beside the methods' default cells.

    Raises:
        InsufficientData: there are no reference points, and no method has enough finished seeds and any return.
    """
    known = references(evidence.references).get(task)
    if known is not None and known.one > known.zero:
        return known.one - known.zero
    means = []
    for method, variant in [*((name, DEFAULT) for name in evidence.methods(task)), *sides]:
        try:
            means.append(abs(float(evidence.final_returns(task, method, variant).mean())))
        except InsufficientData:
            continue
    scale = max(means, default=0.0)
    if not scale > 0.0:
        raise InsufficientData(f"no method has a return on {task} to measure differences by")
    return scale


def at_each(levels: Sequence[float], read: Callable[[float], np.ndarray]) -> dict[float, np.ndarray]:
    """Return `read(level)` for each level in ascending order, without levels that have no data.

    Raises:
        InsufficientData: fewer than `FEWEST_LEVELS` levels have data.
    """
    found, reasons = {}, []
    for level in sorted(levels):
        try:
            found[level] = read(level)
        except InsufficientData as error:
            reasons.append(str(error))
    if len(found) < FEWEST_LEVELS:
        raise InsufficientData(reasons[0])
    return found


def largest_of(steps: Sequence[stats.Estimate], wider: Sequence[stats.Estimate], threshold: float) -> stats.Estimate:
    """Return the largest of several true values with its interval and the p-value against `threshold`.

    All are below the threshold only if each is: the largest p-value of those says so, without any correction. One above
    is found among several tries: the smallest p-value, times their number, says so. In the same way the upper end is
    the largest of all, and the lower end the largest of intervals that are each wider.

    Args:
        steps: each value with its 95 % interval and its two-sided p-value against the threshold.
        wider: the same with intervals of confidence 1 - 0.05 / (number of steps).
        threshold: what p-values are against.
    """
    if any(math.isnan(step.p) for step in steps):
        return stats.Estimate(max(step.value for step in steps))
    value = max(step.value for step in steps)
    low, high = max(step.low for step in wider), max(step.high for step in steps)
    if value < threshold:
        return stats.Estimate(value, low, high, max(step.p for step in steps))
    beyond = min(step.p for step in steps if step.value >= threshold)
    return stats.Estimate(value, low, high, min(1.0, len(steps) * beyond))


def check_budgets(evidence: Evidence, task: str, *sides: tuple[str, Variant]) -> None:
    """Check that all sides, each (method, variant), were trained for the same number of environment steps.

    Raises:
        InsufficientData: they were not, or cells of a side are missing.
    """
    budgets = [evidence.budget(task, method, variant) for method, variant in sides]
    if max(budgets) > (1.0 + BUDGET_TOLERANCE) * min(budgets):
        told = " and ".join(f"{budget:,.0f}" for budget in budgets)
        raise InsufficientData(f"budgets differ on {task}: {told} environment steps")


def check_methods(evidence: Evidence, task: str, *methods: str) -> None:
    """Check the budgets of methods' default cells.

    Raises:
        InsufficientData: as `check_budgets` does.
    """
    check_budgets(evidence, task, *((method, DEFAULT) for method in methods))


def seeds_of(*samples: np.ndarray) -> str:
    """Return the numbers of seeds as text."""
    return " and ".join(str(len(sample)) for sample in samples) + " seeds"


def seeds_at_each(found: Mapping[float, np.ndarray]) -> str:
    """Return the levels and their numbers of seeds as text."""
    counts = sorted({len(sample) for sample in found.values()})
    seeds = "-".join(str(count) for count in dict.fromkeys((counts[0], counts[-1])))
    return f"{seeds} seeds at each of {', '.join(f'{level:g}' for level in found)}"
