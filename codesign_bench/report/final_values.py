"""Final results of each method with their uncertainty: the first part of the page.

Only finished cells count. Intervals over seeds are Student's for a mean and Welch's for a difference.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from codesign_bench.registry import in_order
from codesign_bench.stats import (
    CELL_KEYS,
    MIN_SEEDS,
    final_values,
    mean,
    mean_t_interval,
    probability_of_improvement,
    welch,
)
from codesign_bench.storage.records import DONE

from .cells import PageCell, variants
from .tables import NOTHING, number

SAME_BUDGET = 0.02
"""Largest relative difference in steps between seeds with the same budget."""
STRIP_WIDTH, STRIP_MARGIN = 160.0, 6.0
"""Size of the small pictures of one method's seeds, in drawing units."""


@dataclass(frozen=True)
class Estimate:
    """A quantity's final values over seeds."""

    values: tuple[float, ...]
    mean: float
    low: float
    high: float
    """The 95 % t interval of the mean; NaN for fewer than three seeds, or if all are equal."""

    @property
    def has_interval(self) -> bool:
        """Whether there are enough seeds for an interval."""
        return not np.isnan(self.low)

    @property
    def text(self) -> str:
        """Mean, with its interval if there is one."""
        interval = f" [{number(self.low)}, {number(self.high)}]" if self.has_interval else ""
        return number(self.mean) + interval


@dataclass(frozen=True)
class Strip:
    """Positions of the marks of one estimate on an axis shared by all methods of a task, in drawing units."""

    dots: list[float]
    mean: float
    low: float
    high: float
    has_interval: bool


@dataclass(frozen=True)
class MethodResult:
    """The results of one method."""

    label: str
    seeds: int
    unfinished: int
    env_steps: str
    returns: Estimate
    successes: Estimate
    return_strip: Strip
    success_strip: Strip


@dataclass(frozen=True)
class TaskResult:
    """The methods on one task in one variant, and a verdict on the best."""

    task: str
    variant: str
    return_axis: tuple[float, float]
    """Lowest and highest final return of any seed, in the task's units of reward."""
    methods: list[MethodResult]
    verdict: str


def task_results(cells: Sequence[PageCell], curves: pd.DataFrame) -> list[TaskResult]:
    """Return final return and success for every task, variant and method with a finished cell.

    Args:
        cells: all cells of the results folder.
        curves: rows of `codesign_bench.load_results` for the same folder.
    """
    done = {(cell.task, cell.method, cell.variant, cell.record.seed) for cell in cells if cell.status == DONE}
    rows = zip(*(curves[name] for name in (*CELL_KEYS, "seed")), strict=True)
    finished = curves[[row in done for row in rows]]
    if finished.empty:
        return []
    returns, successes = final_values(finished, "return_mean"), final_values(finished, "success_rate")
    final = returns.merge(successes, on=[*CELL_KEYS, "seed", "env_steps"])
    return [
        _task_result(cells, task, variant, group)
        for task in in_order("tasks", final["task"])
        for variant in variants([cell for cell in cells if cell.task == task])
        if not (group := final[(final["task"] == task) & (final["variant"] == variant)]).empty
    ]


def estimate(values: Sequence[float], *, within: tuple[float, float] = (-np.inf, np.inf)) -> Estimate:
    """Return mean and interval of (N,) values, which cannot be but `within`."""
    low, high = mean_t_interval(values, within=within)
    return Estimate(tuple(values), mean(values), low, high)


def strip(shown: Estimate, axis: tuple[float, float]) -> Strip:
    """Return the positions of the marks of an estimate on an axis from `axis[0]` to `axis[1]`, which ends intervals."""

    def place(value: float) -> float:
        share = (min(max(value, axis[0]), axis[1]) - axis[0]) / (axis[1] - axis[0]) if axis[1] > axis[0] else 0.5
        return round(STRIP_MARGIN + share * (STRIP_WIDTH - 2.0 * STRIP_MARGIN), 1)

    interval = (place(shown.low), place(shown.high)) if shown.has_interval else (0.0, 0.0)
    return Strip([place(value) for value in shown.values], place(shown.mean), *interval, shown.has_interval)


def verdict(estimates: Sequence[tuple[str, Estimate]]) -> str:
    """Return one or two sentences: which (label, return) is highest, and whether it is significantly above the next."""
    ranked = sorted(estimates, key=lambda entry: -entry[1].mean)
    if len(ranked) < 2:
        return "Only one method: nothing to compare it with."
    (first, best), (second, next_best) = ranked[:2]
    lead = f"Highest final return: {first}, {best.text}; next: {second}, {next_best.text}."
    if min(len(best.values), len(next_best.values)) < MIN_SEEDS:
        return f"{lead} With fewer than {MIN_SEEDS} seeds there is no interval, and no ranking."
    found = welch(best.values, next_best.values)
    if np.isnan(found.low):
        return f"{lead} Seeds do not differ, so there is no interval: their spread is unknown."
    share = probability_of_improvement([(best.values, next_best.values)])
    difference = f"{number(found.value)} [{number(found.low)}, {number(found.high)}]"
    told = f"Difference: {difference}; the first is higher in {share:.0%} of pairs of seeds."
    return f"{lead} {told} {'The first is ahead.' if found.low > 0.0 else 'The interval contains 0: it may be chance.'}"


def _task_result(cells: Sequence[PageCell], task: str, variant: str, final: pd.DataFrame) -> TaskResult:
    """Return the result of one task and variant; `final` has one row per finished cell."""
    group = [cell for cell in cells if (cell.task, cell.variant) == (task, variant)]
    axis = float(final["return_mean"].min()), float(final["return_mean"].max())
    methods, returns = [], []
    for method in in_order("methods", final["method"]):
        rows, of_method = final[final["method"] == method], [cell for cell in group if cell.method == method]
        earned = estimate(rows["return_mean"].tolist())
        solved = estimate(rows["success_rate"].tolist(), within=(0.0, 1.0))
        returns.append((of_method[0].label, earned))
        methods.append(
            MethodResult(
                label=of_method[0].label,
                seeds=len(rows),
                unfinished=len(of_method) - len(rows),
                env_steps=_range(rows["env_steps"]),
                returns=earned,
                successes=solved,
                return_strip=strip(earned, axis),
                success_strip=strip(solved, (0.0, 1.0)),
            )
        )
    steps = final.groupby("method")["env_steps"].mean()
    caution = "" if _agree(steps) else " Methods had different budgets (steps); the ranking does not account for this."
    return TaskResult(task, variant, axis, methods, verdict(returns) + caution)


def _range(values: pd.Series) -> str:
    """Return the environment steps of all seeds in thousands: their mean, or lowest and highest if budgets differ.

    Seeds with the same budget end a few steps apart, since batches consist of whole episodes.
    """
    shown = (values.mean(),) if _agree(values) else (values.min(), values.max())
    return NOTHING.join(f"{value / 1e3:,.0f}k" for value in shown)


def _agree(env_steps: pd.Series) -> bool:
    """Return whether the environment steps are of the same budget."""
    return bool(env_steps.max() - env_steps.min() <= SAME_BUDGET * env_steps.max())
