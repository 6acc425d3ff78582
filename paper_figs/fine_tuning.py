"""Fine-tuning on held-out starts compared with training from scratch (the paper's section 5.2).

The paper's claim: fine-tuning a policy that was trained on other starts needs far fewer gradient steps. Returns are
as in the paper; the success rates below, which say when a start is solved, are ours.
"""

from __future__ import annotations

import math

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from codesign_bench.errors import UserError
from codesign_bench.figures.source import curves
from codesign_bench.stats import MIN_SEEDS, curve_statistics
from codesign_bench.storage.frames import require_columns, rows_varying

from ._curves import PANEL_HEIGHT, QUANTITIES, draw_curve, draw_seeds
from ._style import BLUE, COLUMN_WIDTH, ORANGE, PAGE_WIDTH, Dashes, style

TITLE = "Fine-tuning"
SOURCE = curves
NEEDS = "codesign-bench reproduce fine_tuning"
KINDS: dict[str, tuple[str, str, Dashes]] = {
    "finetune": ("from the trained policy", BLUE, "-"),
    "scratch": ("from scratch", ORANGE, "--"),
}
"""Axis that cells vary: its name in the legend, its colour and its dashes."""
INTERVAL = (
    "line: mean over seeds; dotted: not all seeds got this far; thin lines: each seed\n"
    f"band: ± standard error, if {MIN_SEEDS} seeds or more"
)
NEEDED = ("task", "method", "variant", "seed", *QUANTITIES, "gradient_steps")
PANELS_PER_ROW = 4


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the numbers that the figure shows.

    Args:
        frame: rows of `codesign_bench.load_results`; cells that vary another axis are left out.

    Returns:
        Columns task, method, start (k), kind ("finetune" or "scratch"), quantity ("return_mean" or "success_rate"),
        gradient_steps, mean, standard_error (NaN for fewer than three seeds), seeds.

    Raises:
        UserError: a column, or every such variant, is missing.
    """
    require_columns(frame, NEEDED, "the results")
    table = pd.concat([_along_gradient_steps(rows_varying(frame, kind), kind) for kind in KINDS])
    if table.empty:
        raise UserError("no cell of --finetune or --scratch")
    columns = ["task", "method", "start", "kind", "quantity", "gradient_steps", "mean", "standard_error", "seeds"]
    return table[columns].sort_values(columns[:6], ignore_index=True)


def _along_gradient_steps(rows: pd.DataFrame, kind: str) -> pd.DataFrame:
    """Return statistics over seeds along the gradient steps of cells that vary the axis `kind`, per start."""
    tables = []
    for start in sorted(rows[kind].unique()):
        own = rows[rows[kind] == start].drop(columns="env_steps", errors="ignore")
        for quantity in QUANTITIES:
            table = curve_statistics(own.rename(columns={"gradient_steps": "env_steps"}), quantity)
            table = table.rename(columns={"env_steps": "gradient_steps"})
            tables.append(table.assign(kind=kind, start=int(start), quantity=quantity))
    return pd.concat(tables) if tables else pd.DataFrame()


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure: for each start a panel of returns above one of success rates.

    Raises:
        UserError: as `data` does.
    """
    table = data(frame)
    starts = list(table.groupby(["task", "method", "start"]))
    columns = min(len(starts), PANELS_PER_ROW)
    rows = len(QUANTITIES) * math.ceil(len(starts) / columns)
    with style():
        width = COLUMN_WIDTH if columns == 1 else PAGE_WIDTH
        figure = Figure(figsize=(width, PANEL_HEIGHT * rows + 0.7), layout="constrained")
        axes = figure.subplots(rows, columns, squeeze=False, sharey="row")
        for position, ((task, method, start), part) in enumerate(starts):
            block, column = divmod(position, columns)
            top = len(QUANTITIES) * block
            own = frame[(frame["task"] == task) & (frame["method"] == method)]
            for row, quantity in enumerate(QUANTITIES, start=top):
                axis = axes[row, column]
                _draw_panel(axis, part[part["quantity"] == quantity], own, int(str(start)), quantity)
                if column == 0:
                    axis.set_ylabel(QUANTITIES[quantity])
            axes[top, column].set_title(f"{str(task).replace('_', ' ')}, start {start}")
        for axis in axes.flat:
            axis.set_visible(axis.has_data())
        seeds = table.groupby("kind")["seeds"].max()
        handles = [
            Line2D([], [], color=colour, linestyle=dashes, label=f"{label} (n={seeds[kind]})")
            for kind, (label, colour, dashes) in KINDS.items()
            if kind in seeds
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=2, title=INTERVAL, title_fontsize=5.5)
        figure.draw_without_rendering()
    return figure


def _draw_panel(axes: Axes, part: pd.DataFrame, rows: pd.DataFrame, start: int, quantity: str) -> None:
    """Draw both curves of one start: their statistics in `part`, and each seed in the `rows` of the method."""
    for kind, (_, colour, dashes) in KINDS.items():
        varied = rows_varying(rows, kind)
        seeds = varied[varied[kind] == start].sort_values("gradient_steps")
        named = seeds.assign(env_steps=seeds["gradient_steps"], value=seeds[quantity]).dropna(subset=["value"])
        draw_seeds(axes, named, colour, gid=kind)
        curve = part[part["kind"] == kind]
        values, error = curve["mean"], curve["standard_error"]
        along = curve.assign(env_steps=curve["gradient_steps"], centre=values, low=values - error, high=values + error)
        draw_curve(axes, along, colour, dashes, gid=kind)
    axes.set_xlabel("gradient steps")
    if quantity == "success_rate":
        axes.set_ylim(-0.03, 1.03)
