"""Tools of one designer for goals across the goal space (the paper's figure `fig:qualitative_tools`).

The paper's claim: "The designer policy outputs a range of tools depending on the goal location", shown on push. This
figure has every task with a finished cell. A picture shows the scene right after the design step; its position in the
task's grid is that of its goal in the goal space.
"""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from codesign_bench.errors import UserError
from codesign_bench.figures.designed_tools import designed_tools
from codesign_bench.storage.frames import default_rows, require_columns

from ._order import in_task_order
from ._style import COLUMN_WIDTH, PAGE_WIDTH, style
from ._tool_grid import NEEDED, UNSOLVED_NOTE, cut_alike, draw_grid, grid_height, is_map

TITLE = "Tools over goals"
SOURCE = designed_tools
NEEDS = "codesign-bench run --method M --task T"
MAPS_PER_ROW = 3


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the data of each picture.

    Args:
        frame: from `codesign_bench.figures.designed_tools`; variants other than `default` are left out.

    Returns:
        The same rows without pictures, the tasks in the paper's order; empty columns are left out.

    Raises:
        UserError: a column, or every row of the default variant, is missing.
    """
    return _rows(frame).drop(columns="picture").dropna(axis="columns", how="all")


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure: a grid of tools for every task, with its designer and seed; thick frames mark unsolved goals.

    Raises:
        UserError: as `data` does.
    """
    rows = cut_alike(_rows(frame))
    grids = [rows[rows["task"] == task] for task in dict.fromkeys(rows["task"])]
    maps, lines = [grid for grid in grids if is_map(grid)], [grid for grid in grids if not is_map(grid)]
    shelves = [maps[start : start + MAPS_PER_ROW] for start in range(0, len(maps), MAPS_PER_ROW)]
    shelves += [[line] for line in lines]
    width = COLUMN_WIDTH if len(grids) == len(maps) == 1 else PAGE_WIDTH
    map_width = width / min(len(maps), MAPS_PER_ROW) if maps else 0.0
    heights = [max(grid_height(grid, map_width if is_map(grid) else width) for grid in shelf) for shelf in shelves]
    with style():
        figure = Figure(figsize=(width, sum(heights) + 0.15), layout="constrained")
        stacked = figure.subfigures(len(shelves), 1, squeeze=False, height_ratios=heights)
        for band, shelf in zip(stacked.flat[:], shelves, strict=True):
            blocks = band.subfigures(1, round(width / map_width) if is_map(shelf[0]) else 1, squeeze=False)
            for block, grid in zip(blocks.flat[:], shelf, strict=False):
                first = grid.iloc[0]
                draw_grid(block, grid, f"{first['title']}: {first['label']}, seed {first['seed']}")
        figure.supxlabel(UNSOLVED_NOTE, fontsize=5.5)
        figure.draw_without_rendering()
    return figure


def _rows(frame: pd.DataFrame) -> pd.DataFrame:
    require_columns(frame, NEEDED, "the tools")
    rows = default_rows(frame)
    if rows.empty:
        raise UserError("no finished cell of variant 'default'")
    return in_task_order(rows)
