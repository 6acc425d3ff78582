"""Designs as a policy judges them, and as they play: does a critic know which tool a goal calls for (ours)?

For policies that judge designs themselves, as those of `critic_design` do. Per task and method, every dot is a tool on
an evaluation instance: across, the value that the policy expects of it; upwards, the return that it earned with the
policy's own controller. The rank correlation is that of random tools on one instance, averaged over instances, because
a critic that only knows which goals are easy would order all dots together well, and still be no designer.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.stats import spearmanr

from codesign_bench.errors import UserError
from codesign_bench.figures import source
from codesign_bench.stats import CONFIDENCE, MIN_SEEDS, mean_t_interval
from codesign_bench.storage.frames import default_rows, require_columns

from ._order import task_order
from ._style import BLUE, GREY, PAGE_WIDTH, in_order, style

TITLE = "Designs as policies judge them, and as they play"
SOURCE = source.design_values
NEEDS = "codesign-bench headroom --policy CELL"
NEEDED = ("task", "method", "variant", "seed", "label", "instance", "tool", "origin", "value", "return")
DESIGNER, RANDOM = "designer", "random"
COLUMNS = 3
PANEL_HEIGHT = 2.1
"""Inches."""


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return one row per task and method.

    Args:
        frame: rows of `codesign_bench.storage.headroom.load_design_values`; variants other than `default` are left out.

    Returns:
        Columns task, method, label, seeds, instances (of all seeds, of which the correlation is known), tools (random
        ones on an instance), rank_correlation (Spearman's, of the values and the returns of random tools on an
        instance, mean over instances and seeds; those on which all values or all returns are equal have none),
        designer_ahead (share of random tools that earned less than the designer's on the same instance; equal ones
        count half), and `<name>_low`, `<name>_high` of both (t intervals over seeds; NaN for fewer than three).

    Raises:
        UserError: a column, or every row of the default variant, is missing.
    """
    rows = _rows(frame)
    result = []
    for task in task_order(rows["task"]):
        for method in in_order(rows.loc[rows["task"] == task, "method"]):
            own = rows[(rows["task"] == task) & (rows["method"] == method)]
            singles = pd.DataFrame([_of_instance(group) for _, group in own.groupby(["seed", "instance"])])
            seeds = singles.groupby("seed").mean()
            row: dict[str, object] = {
                "task": task,
                "method": method,
                "label": own["label"].iloc[0],
                "seeds": len(seeds),
                "instances": int(singles["rank_correlation"].notna().sum()),
                "tools": int(singles["tools"].max()),
            }
            for name, within in (("rank_correlation", (-1.0, 1.0)), ("designer_ahead", (0.0, 1.0))):
                values = seeds[name].to_numpy()
                low, high = mean_t_interval(values, within=within)
                row |= {name: float(values.mean()), f"{name}_low": low, f"{name}_high": high}
            result.append(row)
    return pd.DataFrame(result)


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure: a panel for each task and method, with the tools of its lowest seed.

    Raises:
        UserError: as `data` does.
    """
    table, rows = data(frame), _rows(frame)
    columns = min(COLUMNS, len(table))
    lines = -(-len(table) // columns)
    with style():
        size = (PAGE_WIDTH * columns / COLUMNS, PANEL_HEIGHT * lines + 0.35)
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(lines, columns, squeeze=False).flat
        for axes, entry in zip(panels, table.to_dict("records"), strict=False):
            own = rows[(rows["task"] == entry["task"]) & (rows["method"] == entry["method"])]
            _draw_panel(axes, own[own["seed"] == own["seed"].min()], entry)
        for axes in list(panels):
            axes.set_axis_off()
        note = f"mean over seeds (n), {CONFIDENCE:.0%} t interval if {MIN_SEEDS} or more;\ndots: the lowest seed"
        handles, labels = figure.axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2, title=note, title_fontsize=5.5)
        figure.draw_without_rendering()
    return figure


def _rows(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of default cells."""
    require_columns(frame, NEEDED, "the tables of design values")
    rows = default_rows(frame)
    if rows.empty:
        raise UserError("no design values of variant 'default'")
    return rows


def _of_instance(rows: pd.DataFrame) -> dict[str, float]:
    """Return what the tools on one instance show."""
    random, designer = (rows[rows["origin"] == origin] for origin in (RANDOM, DESIGNER))
    correlation = np.nan
    if random["value"].nunique() > 1 and random["return"].nunique() > 1:
        correlation = float(spearmanr(random["value"], random["return"])[0])
    own = float(designer["return"].iloc[0])
    ahead = (random["return"] < own).mean() + 0.5 * (random["return"] == own).mean()
    return {
        "seed": rows["seed"].iloc[0],
        "tools": len(random),
        "rank_correlation": correlation,
        "designer_ahead": float(ahead),
    }


def _draw_panel(axes: Axes, rows: pd.DataFrame, entry: Mapping[Hashable, Any]) -> None:
    """Draw the tools of one cell, and what the table says of its task and method."""
    for origin, colour, label in ((RANDOM, GREY, "random tool"), (DESIGNER, BLUE, "designer's tool")):
        own = rows[rows["origin"] == origin]
        axes.plot(own["value"], own["return"], ".", color=colour, markersize=2.5, alpha=0.7, label=label, gid=origin)
    axes.set_xlabel("value that the policy expects")
    axes.set_ylabel("return")
    axes.set_title(
        f"{str(entry['task']).replace('_', ' ')}, {entry['label']} ({entry['seeds']})\n"
        f"rank correlation {_shown(entry, 'rank_correlation')}\n"
        f"ahead of random tools {_shown(entry, 'designer_ahead')}",
        loc="left",
        fontsize=6.5,
    )


def _shown(entry: Mapping[Hashable, Any], name: str) -> str:
    """Return a number with its interval, if it has one."""
    low, high = entry[f"{name}_low"], entry[f"{name}_high"]
    return f"{entry[name]:.2f}" + (f" [{low:.2f}, {high:.2f}]" if low == low else "")
