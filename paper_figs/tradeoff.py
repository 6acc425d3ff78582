"""Design versus control under the trade-off reward of equation 1 (the paper's figure `fig:control_design_ratio`).

The paper's claim on catch balls: the ratio (d_used / d_max) / (c_used / c_max) "indeed correlates with alpha, which
indicates that agents that are directed to prefer saving either material or energy are doing so". This figure has every
task and method with cells of `run --alpha`, and in addition to the ratio both of its parts.
"""

from __future__ import annotations

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from codesign_bench.errors import UserError
from codesign_bench.figures.source import evaluations
from codesign_bench.stats import MIN_SEEDS, mean, standard_error
from codesign_bench.storage.frames import require_columns, rows_varying

from ._order import task_order
from ._style import PAGE_WIDTH, Dashes, in_order, line_styles, style

TITLE = "Trade-off of design and control"
SOURCE = evaluations
NEEDS = "codesign-bench run --method M --task T --seeds 3 --alpha 0 0.3 0.7 1"
NEEDED = ("task", "method", "label", "variant", "alpha", "seed", "material", "effort")
KEYS = ["task", "method", "label", "alpha"]
PANEL_HEIGHT = 1.7
"""Height of a row of panels, in inches."""
NOTE = (
    f"mean over seeds; dots: each seed; bars: ± standard error, if {MIN_SEEDS} seeds or more\n"
    r"equation 1 weights material by $\alpha$ and effort by $1 - \alpha$"
)

QUANTITIES = {
    "ratio": "material / effort",
    "material": r"material $d_{used} / d_{max}$",
    "effort": r"effort $c_{used} / c_{max}$",
}
"""Quantities drawn, one panel each, and their names on the axes."""


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the numbers that the figure shows.

    Args:
        frame: rows of `codesign_bench.storage.frames.load_evaluations`; cells that vary another axis than alpha are
            left out. The ratio of a seed is its mean material divided by its mean effort (NaN if nothing moved).

    Returns:
        Columns task, method, label, quantity ("ratio", "material" or "effort"), alpha, mean, standard_error (NaN for
        fewer than three seeds), seeds.

    Raises:
        UserError: a column, or every cell with an alpha, is missing.
    """
    grouped = _seeds(frame).groupby([*KEYS, "quantity"], sort=False)["value"]
    table = grouped.agg(mean=mean, standard_error=standard_error, seeds="size").reset_index()
    return table[["task", "method", "label", "quantity", "alpha", "mean", "standard_error", "seeds"]]


def _seeds(frame: pd.DataFrame) -> pd.DataFrame:
    """Return one row per quantity and seed, with the columns `KEYS`, seed, quantity, value."""
    require_columns(frame, NEEDED, "the evaluations")
    rows = rows_varying(frame, "alpha")
    if rows.empty:
        raise UserError("no finished cell with an alpha")
    seeds = rows.groupby([*KEYS, "seed"], as_index=False)[["material", "effort"]].mean()
    seeds["ratio"] = seeds["material"] / seeds["effort"].where(seeds["effort"] > 0.0)
    return seeds.melt([*KEYS, "seed"], list(QUANTITIES), "quantity", "value")


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure: a row of panels per task, each quantity over alpha, one line per method.

    Raises:
        UserError: as `data` does.
    """
    table, seeds = data(frame), _seeds(frame)
    styles = line_styles(table["method"])
    tasks = task_order(table["task"])
    with style():
        figure = Figure(figsize=(PAGE_WIDTH, PANEL_HEIGHT * len(tasks) + 0.5), layout="constrained")
        panels = figure.subplots(len(tasks), len(QUANTITIES), squeeze=False)
        for line, task in zip(panels, tasks, strict=True):
            for axes, quantity in zip(line, QUANTITIES, strict=True):
                own, single = (part[(part["task"] == task) & (part["quantity"] == quantity)] for part in (table, seeds))
                _draw_panel(axes, own, single, styles)
                axes.set_ylabel(QUANTITIES[quantity])
            line[0].set_title(str(task).replace("_", " "), loc="left")
        _add_legend(figure, table, styles)
        figure.draw_without_rendering()
    return figure


def _draw_panel(axes: Axes, table: pd.DataFrame, seeds: pd.DataFrame, styles: dict[str, tuple[str, Dashes]]) -> None:
    for method in reversed(in_order(table["method"])):  # the paper's own method on top
        colour, dashes = styles[method]
        own = table[table["method"] == method].sort_values("alpha")
        single = seeds[seeds["method"] == method]
        axes.plot(single["alpha"], single["value"], ".", color=colour, markersize=2.5, alpha=0.5)
        axes.errorbar(
            own["alpha"],
            own["mean"],
            own["standard_error"],
            color=colour,
            linestyle=dashes,
            marker="o",
            markersize=3,
            capsize=2,
            elinewidth=0.8,
            label=method,
        )
    axes.set_xlim(-0.05, 1.05)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel(r"trade-off $\alpha$")


def _add_legend(figure: Figure, table: pd.DataFrame, styles: dict[str, tuple[str, Dashes]]) -> None:
    handles = []
    for method in in_order(table["method"]):
        own = table[table["method"] == method]
        colour, dashes = styles[method]
        low, high = int(own["seeds"].min()), int(own["seeds"].max())
        label = f"{own['label'].iloc[0]} (n={low if low == high else f'{low}-{high}'})"
        handles.append(Line2D([], [], color=colour, linestyle=dashes, marker="o", markersize=3, label=label))
    figure.legend(handles=handles, loc="outside lower center", ncols=3, title=NOTE, title_fontsize=5.5)
