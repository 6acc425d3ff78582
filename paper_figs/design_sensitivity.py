"""How much the tool matters: one scripted controller per task, many tools, many goals (ours).

The premise of the paper's tasks: "no single tool solves all goals". Top: every tool on every goal. Bottom: the fraction
of goals that each random tool solves, compared with the best single tool and with one tool per goal.
"""

from __future__ import annotations

from textwrap import fill

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from codesign_bench.figures import source
from codesign_bench.storage.frames import require_columns

from ._order import task_order
from ._style import BLUE, COLUMN_WIDTH, GREEN, PAGE_WIDTH, RED, Dashes, style

TITLE = "Design sensitivity"
SOURCE = source.design_sensitivity
NEEDS = "codesign-bench plot design_sensitivity"
NEEDED = ("task", "tool", "kind", "goal", "own", "outcome", "success", "outcome_name", "outcome_unit")
PANELS_PER_ROW = 3
PANEL_HEIGHT = 1.5
"""Height of a panel, in inches."""
BINS = 16
LABEL_WIDTH = 34
"""Characters to a line of the label of a colour bar."""

MARKS: dict[str, tuple[str, Dashes, str]] = {
    "best_single": (RED, "-", "best single tool"),
    "own": (BLUE, "-", "script's own tool for each goal"),
    "any": (GREEN, "--", "some tool solves the goal"),
}
"""Lines in the lower panels: column of `data`, then colour, dashes and legend."""


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return one row per task.

    Args:
        frame: columns `NEEDED`: one row per tool and goal; `kind` is "random" or "scripted", `own` is 1 for a scripted
            tool on the goal for which it was designed.

    Returns:
        Columns task, tools, goals, random_mean, random_sd (fraction of goals that a random tool solves), best_single
        (fraction that the best tool solves), own (fraction solved by the tools scripted for them), any (fraction that
        at least one tool solves), outcome_name, outcome_unit, outcome_low, outcome_high (5th and 95th percentile of
        the mean outcome of a random tool).

    Raises:
        UserError: a column is missing, or there is no row.
    """
    require_columns(frame, NEEDED, "the outcomes")
    return pd.DataFrame([_summary(str(name), frame[frame["task"] == name]) for name in task_order(frame["task"])])


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure: per task an image of all tools and goals above a histogram of the tools.

    Raises:
        UserError: as `data` does.
    """
    table = data(frame).set_index("task")
    tasks = list(table.index)
    columns = min(len(tasks), PANELS_PER_ROW)
    blocks = -(-len(tasks) // columns)
    with style():
        width = COLUMN_WIDTH if columns == 1 else PAGE_WIDTH
        figure = Figure(figsize=(width, 2 * blocks * PANEL_HEIGHT + 0.6), layout="constrained")
        axes = figure.subplots(2 * blocks, columns, squeeze=False)
        for position, name in enumerate(tasks):
            block, column = divmod(position, columns)
            rows = frame[frame["task"] == name]
            _draw_matrix(figure, axes[2 * block, column], rows)
            _draw_histogram(axes[2 * block + 1, column], rows, table.loc[name])
            axes[2 * block, column].set_title(str(name).replace("_", " "))
        for axis in axes.flat[:]:
            axis.set_visible(axis.has_data())
        handles = [Line2D([], [], color=colour, linestyle=dash, label=text) for colour, dash, text in MARKS.values()]
        figure.legend(handles=handles, loc="outside lower center", ncols=1 if columns == 1 else len(MARKS))
        figure.draw_without_rendering()
    return figure


def _summary(name: str, rows: pd.DataFrame) -> dict[str, object]:
    solved = rows.pivot(index="tool", columns="goal", values="success").to_numpy(dtype=float)
    random = rows[rows["kind"] == "random"].groupby("tool")
    share, outcome = random["success"].mean(), random["outcome"].mean()
    own = rows.loc[rows["own"] == 1, "success"]
    return {
        "task": name,
        "tools": len(solved),
        "goals": solved.shape[1],
        "random_mean": share.mean(),
        "random_sd": share.std(),
        "best_single": solved.mean(axis=1).max(),
        "own": own.mean(),
        "any": solved.any(axis=0).mean(),
        "outcome_name": rows["outcome_name"].iloc[0],
        "outcome_unit": rows["outcome_unit"].iloc[0],
        "outcome_low": outcome.quantile(0.05),
        "outcome_high": outcome.quantile(0.95),
    }


def _draw_matrix(figure: Figure, axes: Axes, rows: pd.DataFrame) -> None:
    """Draw the outcome of every tool (column, sorted by goals solved) on every goal (row); a dot is a success."""
    outcome = rows.pivot(index="goal", columns="tool", values="outcome")
    success = rows.pivot(index="goal", columns="tool", values="success")
    tools = success.mean().sort_values(kind="stable").index
    goals = success.mean(axis=1).sort_values(kind="stable").index
    values = outcome.loc[goals, tools].to_numpy()
    image = axes.imshow(values, aspect="auto", cmap="cividis", interpolation="nearest")
    goal, tool = np.nonzero(success.loc[goals, tools].to_numpy())
    axes.scatter(tool, goal, s=1.2, color="#E69F00", linewidths=0, marker="s")
    axes.grid(visible=False)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_xlabel(f"{len(tools)} tools")
    axes.set_ylabel(f"{len(goals)} goals")
    bar = figure.colorbar(image, ax=axes, pad=0.02)
    name, unit = rows["outcome_name"].iloc[0], rows["outcome_unit"].iloc[0]
    label = str(name) if unit == "1" else f"{name} ({unit})"
    bar.set_label(fill(label, LABEL_WIDTH), fontsize=5)
    bar.ax.tick_params(labelsize=5)


def _draw_histogram(axes: Axes, rows: pd.DataFrame, summary: pd.Series) -> None:
    """Draw a histogram of random tools over the fraction of goals that they solve."""
    share = rows[rows["kind"] == "random"].groupby("tool")["success"].mean()
    axes.hist(share, bins=list(np.linspace(0.0, 1.0, BINS + 1)), color="#999999")
    for column, (colour, dash, _) in MARKS.items():
        axes.axvline(float(summary[column]), color=colour, linestyle=dash)
    axes.set_xlim(-0.03, 1.03)
    axes.set_xlabel("share of goals solved")
    axes.set_ylabel("random tools")
