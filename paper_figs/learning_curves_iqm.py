"""Success over all tasks together: interquartile means over tasks and seeds (Agarwal et al. 2021).

An interquartile mean leaves out the lowest and the highest quarter. Over the few seeds of one task it would hide those
that fail. Over tasks and seeds together, as here, it leaves out the easiest and the hardest. Success is on a scale that
tasks share, and so is the share of the budget.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from scipy.stats import trim_mean

from codesign_bench.errors import UserError
from codesign_bench.figures.source import curves
from codesign_bench.seeding import generator
from codesign_bench.stats import CONFIDENCE, MIN_SEEDS, bootstrap, interquartile_mean

from ._curves import draw_curve, evaluated_rows, method_labels
from ._order import task_order
from ._style import COLUMN_WIDTH, in_order, line_styles, style

TITLE = "Success over all tasks, interquartile mean"
SOURCE = curves
NEEDS = "codesign-bench run --method all --task all --seeds 6"
COMPARES = True
"""Whether `plot --compare` adds the curves of other results."""

SHARES = np.linspace(0.0, 1.0, 21)
"""Of the budget, at which curves are averaged."""
ALMOST = 0.95
"""Share of a task's longest curve that a seed must have got to, to count (ours); batches overshoot a little."""
INTERVAL = (
    "line: interquartile mean over tasks and seeds\n"
    f"band: {CONFIDENCE:.0%} bootstrap interval, seeds resampled within tasks, if {MIN_SEEDS} or more on each"
)
"""The kind of interval, written on the figure."""


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the numbers that the figure shows, the same in every call.

    Args:
        frame: rows of `codesign_bench.load_results`; variants other than `default` are left out.

    Returns:
        Columns method, share (of the budget), interquartile_mean (of success over tasks and seeds), low, high (NaN if
        a task has fewer than three seeds), tasks (those on which every method has curves), seeds (on all tasks).

    Raises:
        UserError: a column, or every row of the default variant, is missing, or methods have no task in common.
    """
    rows = evaluated_rows(frame)
    methods = in_order(rows["method"])
    samples = {method: _by_task(rows, method) for method in methods}
    common = [task for task in task_order(rows["task"]) if all(task in samples[method] for method in methods)]
    if not common:
        raise UserError("no task on which every method has finished curves")
    rng, tables = generator(0, "learning_curves_iqm"), []
    for method in methods:
        parts = [samples[method][task] for task in common]
        low, high = bootstrap(parts, _interquartile_means, rng)
        table = {
            "method": method,
            "share": SHARES,
            "interquartile_mean": [interquartile_mean(column) for column in np.concatenate(parts).T],
            "low": low,
            "high": high,
            "tasks": len(common),
            "seeds": sum(len(part) for part in parts),
        }
        tables.append(pd.DataFrame(table))
    return pd.concat(tables, ignore_index=True)


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure: one panel, a line with a band for each method.

    Raises:
        UserError: as `data` does.
    """
    table, labels = data(frame), method_labels(frame)
    styles = line_styles(table["method"])
    handles = []
    with style():
        figure = Figure(figsize=(COLUMN_WIDTH, 2.6), layout="constrained")
        axes = figure.subplots()
        for method in reversed(in_order(table["method"])):  # the paper's own method on top
            own = table[table["method"] == method]
            curve = own.rename(columns={"share": "env_steps", "interquartile_mean": "centre"})
            draw_curve(axes, curve, *styles[method], gid=method)
            colour, dashes = styles[method]
            name = f"{labels.get(method, method)} (n={own['seeds'].iloc[0]})"
            handles.append(Line2D([], [], color=colour, linestyle=dashes, label=name))
        axes.set_title(f"tasks: {table['tasks'].iloc[0]}")
        axes.set_xlabel("share of the budget")
        axes.set_ylabel("success rate")
        axes.set_ylim(-0.03, 1.03)
        figure.legend(
            handles=handles[::-1],
            loc="outside lower center",
            ncols=2,
            fontsize=5.5,
            handlelength=1.5,
            columnspacing=1.0,
            title=INTERVAL,
            title_fontsize=5.5,
        )
        figure.draw_without_rendering()
    return figure


def _by_task(rows: pd.DataFrame, method: str) -> dict[str, np.ndarray]:
    """Return success at `SHARES` of the budget, (N, T) for each task, of the seeds that reached its end."""
    found = {}
    for task in rows["task"].unique():
        budget = rows.loc[rows["task"] == task, "env_steps"].max()
        own = rows[(rows["task"] == task) & (rows["method"] == method)]
        seeds = [curve.sort_values("env_steps") for _, curve in own.groupby("seed")]
        ended = [curve for curve in seeds if curve["env_steps"].iloc[-1] >= ALMOST * budget]
        if ended:
            found[str(task)] = np.array([_at_shares(curve) for curve in ended])
    return found


def _at_shares(curve: pd.DataFrame) -> np.ndarray:
    """Return (T,): success at `SHARES` of the curve's steps."""
    steps = curve["env_steps"].to_numpy(dtype=np.float64)
    return np.interp(SHARES * steps[-1], steps, curve["success_rate"].to_numpy(dtype=np.float64))


def _interquartile_means(*samples: np.ndarray) -> np.ndarray:
    """Return (R, T) interquartile means over all tasks and seeds of samples (R, N, T), one for each task."""
    return np.asarray(trim_mean(np.concatenate(samples, axis=1), 0.25, axis=1))
