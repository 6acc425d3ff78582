"""Learning curves of every method on every task (the paper's figure `fig:sample_efficiency`).

The paper's claim: "Across all tasks, our framework achieves improved performance and sample efficiency." Lines are
means over seeds and bands the standard error, as in the paper; the success rates below are ours.
"""

from __future__ import annotations

import math

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import EngFormatter, MaxNLocator

from codesign_bench.errors import UserError
from codesign_bench.paper_tables import SCENES
from codesign_bench.stats import MIN_SEEDS, curve_statistics

from ._style import BAND_OPACITY, COLUMN_WIDTH, PAGE_WIDTH, Dashes, in_order, line_styles, style

TITLE = "Learning curves"

QUANTITIES = {"return_mean": "mean return", "success_rate": "success rate"}
"""Columns drawn, one row of panels each, and their names on the axes."""

INTERVAL = (
    f"line: mean over seeds; dotted: not all seeds got this far\nband: ± standard error, if {MIN_SEEDS} seeds or more"
)
"""The kind of interval, written on the figure."""
PANELS_PER_ROW = 3
PANEL_HEIGHT = 1.5
"""Height of a panel, in inches."""
SLIVER = 0.05
"""Largest part of a curve's length that counts as too short to see."""
NEEDED = ("env_steps", "task", "method", "variant", "seed", *QUANTITIES)


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the numbers that the figure shows.

    Args:
        frame: rows as `codesign_bench.load_results` gives them; variants other than `default` are left out.

    Returns:
        Columns task, method, quantity ("return_mean" or "success_rate"), env_steps, mean, standard_error (NaN for
        fewer than three seeds), seeds (how many reached this step).

    Raises:
        UserError: a column, or every row of the default variant, is missing.
    """
    missing = [column for column in NEEDED if column not in frame.columns]
    if missing:
        raise UserError(f"learning_curves: the results lack the columns {', '.join(missing)}")
    rows = frame[(frame["variant"] == "default") & frame["return_mean"].notna()]
    if rows.empty:
        raise UserError("learning_curves: no evaluated cell of variant 'default'; run some with: codesign-bench run")
    tables = [curve_statistics(rows, quantity).assign(quantity=quantity) for quantity in QUANTITIES]
    columns = ["task", "method", "quantity", "env_steps", "mean", "standard_error", "seeds"]
    return pd.concat(tables, ignore_index=True)[columns]


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure: for each task a panel of returns above one of success rates, and one legend with seed counts.

    Args:
        frame: rows as `codesign_bench.load_results` gives them; a column `label` names the methods in the legend.

    Raises:
        UserError: as `data` does.
    """
    table = data(frame)
    styles = line_styles(table["method"])
    tasks = _in_order(table["task"])
    columns = min(len(tasks), PANELS_PER_ROW)
    rows = len(QUANTITIES) * math.ceil(len(tasks) / columns)
    width = COLUMN_WIDTH if columns == 1 else PAGE_WIDTH
    with style():
        figure = Figure(figsize=(width, rows * PANEL_HEIGHT + 0.9), layout="constrained")
        axes = figure.subplots(rows, columns, squeeze=False)
        for position, task in enumerate(tasks):
            block, column = divmod(position, columns)
            top = len(QUANTITIES) * block
            for row, quantity in enumerate(QUANTITIES, start=top):
                curves = table[(table["task"] == task) & (table["quantity"] == quantity)]
                _draw_panel(axes[row, column], curves, quantity, styles)
            axes[top, column].set_title(str(task).replace("_", " "))
        for axis in axes.flat:
            axis.set_visible(axis.has_data())
        _add_legend(figure, table, _labels(frame), columns=2 if columns == 1 else 3)
        figure.draw_without_rendering()  # ticks take their settings when first drawn, which must be before leaving
    return figure


def _in_order(tasks: pd.Series[str]) -> list[str]:
    """Return the tasks in the paper's order, those of third parties last."""
    present = set(tasks)
    return [name for name in SCENES if name in present] + sorted(present - set(SCENES))


def _draw_panel(axes: Axes, curves: pd.DataFrame, quantity: str, styles: dict[str, tuple[str, Dashes]]) -> None:
    """Draw one quantity of one task."""
    for method in reversed(in_order(curves["method"])):  # the paper's own method lies on top
        _draw_curve(axes, curves[curves["method"] == method], *styles[method], gid=method)
    axes.set_xlabel("environment steps")
    axes.set_ylabel(QUANTITIES[quantity])
    axes.xaxis.set_major_formatter(EngFormatter(sep=""))
    axes.xaxis.set_major_locator(MaxNLocator(5))
    if quantity == "success_rate":
        axes.set_ylim(-0.03, 1.03)


def _draw_curve(axes: Axes, curve: pd.DataFrame, colour: str, dashes: Dashes, gid: str) -> None:
    """Draw one method's mean and band; where some seeds are missing, the mean is dotted."""
    curve = _without_slivers(curve)
    complete = curve["seeds"] == curve["seeds"].max()
    steps, values, error = curve["env_steps"], curve["mean"], curve["standard_error"]
    axes.plot(steps, values.where(complete), color=colour, linestyle=dashes, gid=gid)
    if not complete.all():
        # The dotted stretches start and end on the solid ones.
        dotted = ~complete | ~complete.shift(-1, fill_value=True) | ~complete.shift(1, fill_value=True)
        axes.plot(steps, values.where(dotted), color=colour, linestyle=":", gid=f"{gid} (fewer seeds)")
    if error.notna().any():
        axes.fill_between(steps, values - error, values + error, color=colour, alpha=BAND_OPACITY, linewidth=0)


def _without_slivers(curve: pd.DataFrame) -> pd.DataFrame:
    """Cut off ends of a curve that some seeds lack and that are too short to see.

    Seeds end on whole batches of whole episodes, so their last evaluations lie a few steps apart; the mean over the
    few that went farthest would stand as a spike at the end of the line. `data` keeps these rows.
    """
    steps = curve["env_steps"]
    complete = steps[curve["seeds"] == curve["seeds"].max()]
    sliver = SLIVER * steps.max()
    first = complete.min() if complete.min() - steps.min() < sliver else steps.min()
    last = complete.max() if steps.max() - complete.max() < sliver else steps.max()
    return curve[(steps >= first) & (steps <= last)]


def _add_legend(figure: Figure, table: pd.DataFrame, labels: dict[str, str], *, columns: int) -> None:
    """Put one legend with each method's number of seeds below the panels and the meaning of the bands."""
    styles = line_styles(table["method"])
    handles = []
    for method in in_order(table["method"]):
        colour, dashes = styles[method]
        label = f"{labels.get(method, method)} (n={_seed_count(table[table['method'] == method])})"
        handles.append(Line2D([], [], color=colour, linestyle=dashes, label=label))
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, title=INTERVAL, title_fontsize=5.5)


def _seed_count(rows: pd.DataFrame) -> str:
    """Return a method's number of seeds, or its range over the tasks."""
    counts = rows.groupby("task")["seeds"].max()
    low, high = int(counts.min()), int(counts.max())
    return str(high) if low == high else f"{low}-{high}"


def _labels(frame: pd.DataFrame) -> dict[str, str]:
    """Return the legend's names of the methods, where the frame gives any."""
    if "label" not in frame.columns:
        return {}
    known = frame.dropna(subset=["label"]).drop_duplicates("method")
    return dict(zip(known["method"], known["label"], strict=True))
