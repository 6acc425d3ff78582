"""Tools of designers under the trade-off reward, over alpha (the paper's figure `fig:qualitative-tradeoff`).

The paper's finding on catch balls: "As alpha increases, the created tools have shorter links at the sides to decrease
material usage." Every row is one designer, trained with its own alpha, over the same goals.
"""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from codesign_bench.errors import UserError
from codesign_bench.figures.designed_tools import designed_tools
from codesign_bench.storage.frames import require_columns, rows_varying

from ._order import in_task_order
from ._style import PAGE_WIDTH, style
from ._tool_grid import NEEDED, UNSOLVED_NOTE, cut_alike, draw_grid, grid_height

TITLE = "Tools over the trade-off"
SOURCE = designed_tools
NEEDS = "codesign-bench run --method M --task T --alpha 0 0.3 0.7 1"
ALSO_NEEDED = ("material",)
PICTURES = 6
"""Largest number of pictures of one designer, spread over its goals."""


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the data of each picture.

    Args:
        frame: from `codesign_bench.figures.designed_tools`; cells that vary another axis than alpha are left out.

    Returns:
        The rows drawn, without pictures, by task and alpha; empty columns are left out.

    Raises:
        UserError: a column, or every cell with an alpha, is missing.
    """
    return _rows(frame).drop(columns="picture").dropna(axis="columns", how="all")


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure: a row of tools for each task and alpha, with the mean fraction of material that they use.

    Raises:
        UserError: as `data` does.
    """
    rows = cut_alike(_rows(frame))
    grids = [grid for _, grid in rows.groupby(["task", "alpha"], sort=False)]
    heights = [grid_height(grid, PAGE_WIDTH) for grid in grids]
    with style():
        figure = Figure(figsize=(PAGE_WIDTH, sum(heights) + 0.15), layout="constrained")
        blocks = figure.subfigures(len(grids), 1, squeeze=False, height_ratios=heights)
        for block, grid in zip(blocks.flat[:], grids, strict=True):
            first = grid.iloc[0]
            title = rf"{first['title']}: {first['label']}, seed {first['seed']}, $\alpha$ = {first['alpha']:g}"
            draw_grid(block, grid, f"{title}; mean material {grid['material'].mean():.2f} of the maximum")
        figure.supxlabel(UNSOLVED_NOTE, fontsize=5.5)
        figure.draw_without_rendering()
    return figure


def _rows(frame: pd.DataFrame) -> pd.DataFrame:
    require_columns(frame, (*NEEDED, *ALSO_NEEDED), "the tools")
    rows = rows_varying(frame, "alpha")
    if rows.empty:
        raise UserError("no finished cell with an alpha")
    parts = [_in_a_row(grid) for _, grid in in_task_order(rows).groupby(["task", "alpha"], sort=True)]
    return in_task_order(pd.concat(parts, ignore_index=True))


def _in_a_row(grid: pd.DataFrame) -> pd.DataFrame:
    """Return `PICTURES` of a grid, evenly chosen, in one row."""
    count = min(PICTURES, len(grid))
    chosen = [round(position * (len(grid) - 1) / max(1, count - 1)) for position in range(count)]
    return grid.iloc[chosen].assign(row=0, column=range(count), up="")
