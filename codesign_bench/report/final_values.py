"""What each method reached at the end of training, and how sure that is: the answer that the page gives first.

Only finished cells count. Intervals are bootstrap intervals over seeds (`stats.py`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from codesign_bench.registry import in_order
from codesign_bench.seeding import generator
from codesign_bench.stats import (
    CELL_KEYS,
    MIN_SEEDS,
    final_rng,
    final_values,
    interquartile_mean,
    mean,
    mean_difference_interval,
    mean_interval,
    probability_of_improvement,
)
from codesign_bench.storage.records import DONE

from .cells import PageCell, variants
from .tables import NOTHING, number

SEED = 0
"""Of the bootstrap; every interval has a stream of its own."""
SAME_BUDGET = 0.02
"""Largest part of the steps by which seeds of one budget differ."""
STRIP_WIDTH, STRIP_MARGIN = 160.0, 6.0
"""Of the small pictures of one method's seeds, in the units of their drawing."""


@dataclass(frozen=True)
class Estimate:
    """A quantity's final values over seeds."""

    values: tuple[float, ...]
    mean: float
    interquartile_mean: float
    low: float
    high: float
    """Ends of the 95 % bootstrap interval of the mean; NaN for fewer than three seeds."""

    @property
    def has_interval(self) -> bool:
        """Whether there are seeds enough for an interval."""
        return not np.isnan(self.low)

    @property
    def text(self) -> str:
        """Mean, and interval if there is one."""
        interval = f" [{number(self.low)}, {number(self.high)}]" if self.has_interval else ""
        return number(self.mean) + interval


@dataclass(frozen=True)
class Strip:
    """Where the marks of one estimate stand on an axis that all methods of a task share, in the drawing's units."""

    dots: list[float]
    mean: float
    low: float
    high: float
    has_interval: bool


@dataclass(frozen=True)
class MethodResult:
    """One method's line."""

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
    """The methods on one task in one variant, and what can be said of the best."""

    task: str
    variant: str
    return_axis: tuple[float, float]
    """Lowest and highest final return of any seed, in the task's units of reward."""
    methods: list[MethodResult]
    verdict: str


def task_results(cells: Sequence[PageCell], curves: pd.DataFrame) -> list[TaskResult]:
    """Return final return and success of every task, variant and method that has a finished cell.

    Args:
        cells: all cells of the results folder.
        curves: rows as `codesign_bench.load_results` gives them, of the same folder.
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


def estimate(values: Sequence[float], rng: np.random.Generator) -> Estimate:
    """Return means and interval of (N,) values; `rng` draws the interval's resamples."""
    low, high = mean_interval(values, rng)
    return Estimate(tuple(values), mean(values), interquartile_mean(values), low, high)


def strip(shown: Estimate, axis: tuple[float, float]) -> Strip:
    """Return where the marks of an estimate stand on an axis from `axis[0]` to `axis[1]`."""

    def place(value: float) -> float:
        share = (value - axis[0]) / (axis[1] - axis[0]) if axis[1] > axis[0] else 0.5
        return round(STRIP_MARGIN + share * (STRIP_WIDTH - 2.0 * STRIP_MARGIN), 1)

    interval = (place(shown.low), place(shown.high)) if shown.has_interval else (0.0, 0.0)
    return Strip([place(value) for value in shown.values], place(shown.mean), *interval, shown.has_interval)


def verdict(estimates: Sequence[tuple[str, Estimate]]) -> str:
    """Return in a sentence or two which (label, return) is highest, and how sure it is that it is above the next."""
    ranked = sorted(estimates, key=lambda entry: -entry[1].mean)
    if len(ranked) < 2:
        return "One method alone: nothing to compare it with."
    (first, best), (second, next_best) = ranked[:2]
    lead = f"Highest final return: {first}, {best.text}; next: {second}, {next_best.text}."
    if not (best.has_interval and next_best.has_interval):
        return f"{lead} Fewer than {MIN_SEEDS} seeds give no interval: too little to rank them."
    low, high = mean_difference_interval(best.values, next_best.values, generator(SEED, f"report {first} {second}"))
    share = probability_of_improvement([(best.values, next_best.values)])
    difference = f"{number(best.mean - next_best.mean)} [{number(low)}, {number(high)}]"
    told = f"Difference: {difference}; in {share:.0%} of pairs of seeds the first is above."
    return f"{lead} {told} {'The first is ahead.' if low > 0.0 else 'The interval holds 0: the order may be chance.'}"


def _task_result(cells: Sequence[PageCell], task: str, variant: str, final: pd.DataFrame) -> TaskResult:
    """Return the result of one task and variant; `final` has one row per finished cell."""
    group = [cell for cell in cells if (cell.task, cell.variant) == (task, variant)]
    axis = float(final["return_mean"].min()), float(final["return_mean"].max())
    methods, returns = [], []
    for method in in_order("methods", final["method"]):
        rows, of_method = final[final["method"] == method], [cell for cell in group if cell.method == method]
        earned, solved = (
            estimate(rows[column].tolist(), final_rng(task, method, variant, column))
            for column in ("return_mean", "success_rate")
        )
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
    caution = "" if _agree(steps) else " Methods had different budgets (steps), which this ranking does not consider."
    return TaskResult(task, variant, axis, methods, verdict(returns) + caution)


def _range(values: pd.Series) -> str:
    """Return the environment steps of all seeds in thousands: their mean, or lowest and highest where budgets differ.

    Seeds of one budget end on whole batches of whole episodes, a few steps apart.
    """
    shown = (values.mean(),) if _agree(values) else (values.min(), values.max())
    return NOTHING.join(f"{value / 1e3:,.0f}k" for value in shown)


def _agree(env_steps: pd.Series) -> bool:
    """Return whether environment steps are those of one budget."""
    return bool(env_steps.max() - env_steps.min() <= SAME_BUDGET * env_steps.max())
