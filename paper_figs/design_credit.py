"""Final return of every architecture under both credits for the design, seed by seed (ours; the study `credit`).

A dot is a seed, a bar the mean over the seeds of a cell's kind.
"""

from __future__ import annotations

import math
from textwrap import fill

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from codesign_bench.errors import UserError
from codesign_bench.figures.source import curves
from codesign_bench.storage.frames import require_columns, rows_varying
from codesign_bench.text_tables import latex, markdown

from ._curves import PANELS_PER_ROW
from ._order import task_order
from ._style import PAGE_WIDTH, in_order, line_styles, style

TITLE = "Credit for the design"
SOURCE = curves
NEEDS = "codesign-bench reproduce --study credit"
AXIS = "credit"
QUANTITIES = ("return_mean", "success_rate")
NEEDED = ("task", "method", "label", "variant", "seed", "env_steps", *QUANTITIES)
PANEL_HEIGHT = 1.5
LABEL_WIDTH = 15
"""Letters of a line of a label."""
SPREAD = 0.08
"""Distance between neighbouring dots, in places of the axis."""


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the numbers that the figure shows: one row per task, method, credit and seed.

    Args:
        frame: rows of `codesign_bench.load_results`; only cells that vary only the axis `credit` count.

    Returns:
        Columns task, method, label, credit, seed, env_steps, return_mean and success_rate at the last evaluation.

    Raises:
        UserError: a column, or every cell with a credit, is missing.
    """
    require_columns(frame, NEEDED, "the learning curves")
    rows = rows_varying(frame, AXIS)
    if rows.empty:
        raise UserError("no cell with a credit")
    keys = ["task", "method", "variant", "seed"]
    last = rows.sort_values("env_steps").groupby(keys, as_index=False, sort=False).last()
    last["label"] = [_named(label, credit) for label, credit in zip(last["label"], last[AXIS], strict=True)]
    order = {name: place for place, name in enumerate(task_order(last["task"]))}
    methods = {name: place for place, name in enumerate(in_order(last["method"]))}
    last = last.assign(_task=last["task"].map(order), _method=last["method"].map(methods))
    last = last.sort_values(["_task", "_method", AXIS, "seed"])
    return last[["task", "method", "label", AXIS, "seed", "env_steps", *QUANTITIES]].reset_index(drop=True)


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure: a panel of final returns per task.

    Raises:
        UserError: as `data` does.
    """
    table = data(frame)
    tasks = task_order(table["task"])
    columns = min(len(tasks), PANELS_PER_ROW)
    rows = math.ceil(len(tasks) / columns)
    with style():
        figure = Figure(figsize=(PAGE_WIDTH, rows * PANEL_HEIGHT + 0.4), layout="constrained")
        axes = figure.subplots(rows, columns, squeeze=False)
        for axis, task in zip(axes.flat, tasks, strict=False):
            _draw_panel(axis, table[table["task"] == task], str(task).replace("_", " "))
        for axis in axes.flat[len(tasks) :]:
            axis.set_visible(False)
        for line in axes:
            line[0].set_ylabel("final return")
        figure.supxlabel("dot: one seed; bar: mean over seeds", fontsize=6)
        figure.draw_without_rendering()
    return figure


def texts(frame: pd.DataFrame) -> dict[str, str]:
    """Return the table as text by file ending: Markdown and LaTeX.

    Raises:
        UserError: as `data` does.
    """
    header = ["task", "method", "seeds", "steps", "return", "of each seed", "success"]
    rows = [
        [
            str(task).replace("_", " "),
            str(label),
            str(len(part)),
            f"{part['env_steps'].mean():,.0f}",
            f"{part['return_mean'].mean():.2f}",
            ", ".join(f"{value:.2f}" for value in part["return_mean"]),
            f"{part['success_rate'].mean():.2f}",
        ]
        for (task, _, label, _), part in data(frame).groupby(["task", "method", "label", AXIS], sort=False)
    ]
    return {"md": markdown(header, rows), "tex": latex(header, rows)}


def _named(label: str, credit: str) -> str:
    """Return a label that names the credit; that of some methods does so already."""
    return label if label.endswith(f"{credit} credit") else f"{label}, {credit} credit"


def _draw_panel(axes: Axes, table: pd.DataFrame, title: str) -> None:
    styles = line_styles(table["method"])
    groups = list(table.groupby(["method", "label", AXIS], sort=False))
    for place, ((method, _, _), part) in enumerate(groups):
        colour, _ = styles[str(method)]
        values = part["return_mean"].to_numpy()
        shift = [SPREAD * (index - 0.5 * (len(values) - 1)) for index in range(len(values))]
        axes.plot([place + offset for offset in shift], values, "o", color=colour, markersize=3.0)
        axes.plot([place - 0.3, place + 0.3], [values.mean()] * 2, color=colour, linewidth=1.2)
    # Neighbours' labels would overlap on one line each.
    names = ["\n".join(fill(part, LABEL_WIDTH) for part in str(label).split(", ")) for (_, label, _), _ in groups]
    axes.set_xticks(range(len(groups)), names, fontsize=4.5)
    axes.set_xlim(-0.6, len(groups) - 0.4)
    axes.set_title(title)
