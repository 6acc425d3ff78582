"""Final return and success of every method on every task, with intervals over seeds: the benchmark's table (ours).

Numbers are means over seeds of the last evaluation of each; cells that are not finished, and seeds that stopped early,
are left out. The normalised score is 0 for a random tool held still and 1 for the best known
(`docs/reference_points.md`); only this score is averaged over tasks. Minutes are the median over cells as they ran, in
parallel with others. The time of a cell that shared its core says nothing about the method. The late gain is how much
the mean curve still rose over the last third of its steps, in normalised score: near 0, the budget was long enough.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from codesign_bench.figures.source import final_curves
from codesign_bench.stats import (
    CONFIDENCE,
    MIN_SEEDS,
    final_values,
    late_gains,
    mean_across,
    mean_t_interval,
    normalized_score,
)
from codesign_bench.storage.reference_points import reference_points_in, references
from codesign_bench.text_tables import latex, markdown

from ._curves import PANELS_PER_ROW, QUANTITIES, evaluated_rows, method_labels
from ._order import task_order
from ._style import PAGE_WIDTH, SEED_DOTS, in_order, line_styles, style

TITLE = "Final results"
SOURCE = final_curves
NEEDS = "codesign-bench run --method all --task T --seeds 6"
ROW_HEIGHT = 0.17
"""Height of a method in a panel, in inches."""
INTERVAL = (
    f"large dot: mean over seeds (n); small dots: each seed; bar: {CONFIDENCE:.0%} t interval, if {MIN_SEEDS} or more"
)
"""The kind of interval, written on the figure."""
DIGITS = 2
SCORE = "normalized_score"
OF_SCORE = ("normalised score", "late gain")
"""Columns of the text that need reference points."""
AVERAGE = "average"
"""In the place of a task: the mean over all tasks that have reference points."""
SAME_BUDGET = 0.02
"""Largest part of the steps by which methods of one budget differ (ours)."""
BOUNDS = {"success_rate": (0.0, 1.0)}
"""Range of a quantity, which ends its intervals."""
FARTHEST_SHARE = 0.9
"""A seed counts if it has at least this fraction of the most steps of its method (ours)."""


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return one row per task and method, then one per method for the average over tasks, the same in every call.

    The average is over the tasks that have reference points; a method that lacks one of them has none.

    Args:
        frame: rows of `codesign_bench.load_results`; variants other than `default` are left out.

    Returns:
        Columns task, method, label, seeds, env_steps (mean over seeds), then for each quantity ("return_mean",
        "success_rate", "normalized_score") itself, `<quantity>_low` and `<quantity>_high` (NaN for fewer than three
        seeds), late_gain (of the normalised score over the last third of the steps), and minutes (median over seeds).
        The normalised score and its gain are NaN where the task has no reference points, everything else but seeds
        (the fewest) and steps is NaN in an average.

    Raises:
        UserError: a column, or every row of the default variant, is missing.
    """
    rows = evaluated_rows(frame)
    labels = method_labels(frame)
    finals = {name: final_values(rows, name) for name in (*QUANTITIES, "wall_s")}
    scales = references(reference_points_in(rows))
    gains = late_gains(rows, "return_mean").set_index(["task", "method"])["late_gain"]
    result, scores = [], dict[str, dict[str, np.ndarray]]()
    for task in task_order(rows["task"]):
        for method in in_order(rows.loc[rows["task"] == task, "method"]):
            own = {name: _ended(table, task, method) for name, table in finals.items()}
            row: dict[str, object] = {
                "task": task,
                "method": method,
                "label": labels.get(method, method),
                "seeds": len(own["wall_s"]),
                "env_steps": float(own["wall_s"]["env_steps"].mean()),
            }
            for name in QUANTITIES:
                values = own[name][name].to_numpy()
                low, high = mean_t_interval(values, within=BOUNDS.get(name, (-math.inf, math.inf)))
                row |= {name: float(values.mean()), f"{name}_low": low, f"{name}_high": high}
            # The score is linear in the return, and so are the ends of its interval.
            for end in ("", "_low", "_high"):
                row[SCORE + end] = normalized_score(float(str(row[f"return_mean{end}"])), scales.get(task))
            if task in scales:
                earned = own["return_mean"]["return_mean"].to_numpy()
                scores.setdefault(method, {})[task] = np.asarray(normalized_score(earned, scales[task]))
            scored = [normalized_score(value, scales.get(task)) for value in (float(gains[task, method]), 0.0)]
            row["late_gain"] = scored[0] - scored[1]  # a difference of returns, in units of the scale
            result.append({**row, "minutes": float(own["wall_s"]["wall_s"].median()) / 60.0})
    table = pd.DataFrame(result)
    return pd.concat([table, *_averages(table, scores)], ignore_index=True)


def per_task(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of `data` without the averages."""
    return table[table["task"] != AVERAGE]


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure: one panel of success rates for each task, one line for each method.

    Raises:
        UserError: as `data` does.
    """
    table, finals = per_task(data(frame)), final_values(evaluated_rows(frame), "success_rate")
    tasks = task_order(table["task"])
    columns = min(len(tasks), PANELS_PER_ROW)
    rows = math.ceil(len(tasks) / columns)
    most = int(table.groupby("task").size().max())
    colours = {name: colour for name, (colour, _) in line_styles(table["method"]).items()}  # the same in every panel
    with style():
        figure = Figure(figsize=(PAGE_WIDTH, rows * (ROW_HEIGHT * most + 0.5) + 0.3), layout="constrained")
        axes = figure.subplots(rows, columns, squeeze=False)
        for axis, task in zip(axes.flat, tasks, strict=False):
            own = table[table["task"] == task]
            seeds = [_ended(finals, task, method)["success_rate"].tolist() for method in own["method"]]
            _draw_panel(axis, own, seeds, colours, str(task).replace("_", " "))
        for axis in axes.flat[len(tasks) :]:
            axis.set_visible(False)
        figure.supxlabel(INTERVAL, fontsize=6)
        figure.draw_without_rendering()
    return figure


def texts(frame: pd.DataFrame) -> dict[str, str]:
    """Return the table as text by file ending: Markdown and LaTeX.

    Raises:
        UserError: as `data` does.
    """
    table = data(frame)
    scored = table[SCORE].notna().any()
    header = ["task", "method", "seeds", "steps", "return", "success", *OF_SCORE, "minutes a cell"]
    count = per_task(table.dropna(subset=[SCORE]))["task"].nunique()
    rows = [
        [
            f"average of {count} tasks" if row["task"] == AVERAGE else str(row["task"]).replace("_", " "),
            str(row["label"]),
            str(row["seeds"]),
            f"{row['env_steps']:,.0f}",
            *(_with_interval(row, name) for name in (*QUANTITIES, SCORE)),
            "-" if math.isnan(row["late_gain"]) else f"{row['late_gain']:+.{DIGITS}f}",
            "-" if math.isnan(row["minutes"]) else f"{row['minutes']:.1f}",
        ]
        for row in table.to_dict("records")
    ]
    if not scored:
        unknown = header.index(OF_SCORE[0])
        header, *rows = ([*line[:unknown], *line[unknown + len(OF_SCORE) :]] for line in (header, *rows))
    return {"md": markdown(header, rows), "tex": latex(header, rows)}


def success_by_task(table: pd.DataFrame) -> str:
    """Return the success rates of `data` as a Markdown table, tasks in rows and methods in columns."""
    table = per_task(table)
    methods = in_order(table["method"])
    by_cell = {(row["task"], row["method"]): row for row in table.to_dict("records")}
    rows = [
        [
            str(task).replace("_", " "),
            _range(table.loc[table["task"] == task, "seeds"]),
            _steps(table.loc[table["task"] == task, "env_steps"]),
            *(
                _with_interval(by_cell[task, name], "success_rate") if (task, name) in by_cell else "-"
                for name in methods
            ),
        ]
        for task in task_order(table["task"])
    ]
    return markdown(["task", "seeds", "steps", *(f"`{name}`" for name in methods)], rows)


def _averages(table: pd.DataFrame, scores: Mapping[str, Mapping[str, np.ndarray]]) -> list[pd.DataFrame]:
    """Return the rows of the averages over tasks.

    Args:
        table: the rows of every task.
        scores: method -> task -> normalised scores of its seeds, for tasks that have any.
    """
    tasks = {task for of_method in scores.values() for task in of_method}
    rows = []
    for method in in_order(scores) if len(tasks) > 1 else ():
        if set(scores[method]) != tasks:
            continue
        own = table[(table["method"] == method) & table["task"].isin(tasks)]
        found = mean_across(list(scores[method].values()))
        rows.append(
            {
                "task": AVERAGE,
                "method": method,
                "label": own["label"].iloc[0],
                "seeds": own["seeds"].min(),
                "env_steps": own["env_steps"].mean(),
                SCORE: own[SCORE].mean(),
                f"{SCORE}_low": found.low,
                f"{SCORE}_high": found.high,
            }
        )
    return [pd.DataFrame(rows)] if rows else []


def _steps(values: pd.Series[float]) -> str:
    """Return steps in thousands: the mean over methods, or lowest and highest where their budgets differ."""
    same = values.max() - values.min() <= SAME_BUDGET * values.max()
    shown = (values.mean(),) if same else (values.min(), values.max())
    return "-".join(f"{value / 1e3:,.0f}k" for value in shown)


def _range(values: pd.Series[int]) -> str:
    return str(values.min()) if values.min() == values.max() else f"{values.min()}-{values.max()}"


def _ended(table: pd.DataFrame, task: str, method: str) -> pd.DataFrame:
    """Return the rows of the seeds that reached the end of their budget."""
    own = table[(table["task"] == task) & (table["method"] == method)]
    return own[own["env_steps"] >= FARTHEST_SHARE * own["env_steps"].max()]


def _draw_panel(
    axes: Axes, table: pd.DataFrame, seeds: Sequence[Sequence[float]], colours: Mapping[str, str], title: str
) -> None:
    """Draw one task: for each row of the table a line with its interval, its mean and each of its seeds."""
    for place, row in enumerate(table.to_dict("records")):
        colour = colours[str(row["method"])]
        axes.plot([row["success_rate_low"], row["success_rate_high"]], [place, place], color=colour, linewidth=2.0)
        axes.plot(seeds[place], [place] * len(seeds[place]), zorder=3, **SEED_DOTS)
        axes.plot([row["success_rate"]], [place], "o", color=colour, markersize=4.0, gid=str(row["method"]))
    axes.set_yticks(range(len(table)), [f"{row['label']} ({row['seeds']})" for row in table.to_dict("records")])
    axes.set_ylim(len(table) - 0.5, -0.5)
    axes.set_xlim(-0.03, 1.03)
    axes.set_xlabel("success rate")
    axes.set_title(title)


def _with_interval(row: dict[object, object], name: str) -> str:
    centre, low, high = (float(str(row[key])) for key in (name, f"{name}_low", f"{name}_high"))
    if math.isnan(centre):
        return "-"
    interval = "" if math.isnan(low) else f" [{low:.{DIGITS}f}, {high:.{DIGITS}f}]"
    return f"{centre:.{DIGITS}f}{interval}"
