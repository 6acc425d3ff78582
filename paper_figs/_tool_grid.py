"""A grid of pictures of tools, placed by their goals."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import SubFigure

from ._pictures import cut_to_differences, show
from ._style import RED

NEEDED = (
    *("task", "title", "method", "label", "variant", "alpha", "seed", "instance", "success"),
    *("row", "column", "across", "up", "goal", "picture"),
)
"""Columns of a frame of tools from `codesign_bench.figures.designed_tools`."""

UNSOLVED_COLOUR, UNSOLVED_WIDTH = RED, 1.5
UNSOLVED_NOTE = "thick frame: the episode with this tool did not succeed"
HEADER_HEIGHT = 0.36
"""Room for title and labels, in inches."""
FONT_SIZE = 5.5


def cut_alike(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows with all pictures of a task cropped to the part in which they differ."""
    pictures = pd.Series(index=rows.index, dtype=object)
    for _, own in rows.groupby("task"):
        pictures[own.index] = pd.Series(cut_to_differences(list(own["picture"])), index=own.index)
    return rows.assign(picture=pictures)


def is_map(grid: pd.DataFrame) -> bool:
    """Return whether pictures are arranged by two entries of their goals; otherwise by one entry, in a row."""
    return bool(grid["up"].iloc[0])


def grid_height(grid: pd.DataFrame, width: float) -> float:
    """Return the height of a grid of `width`, in inches."""
    lines, columns = _size(grid)
    picture = grid["picture"].iloc[0]
    return lines * width / columns * picture.shape[0] / picture.shape[1] + HEADER_HEIGHT


def draw_grid(block: SubFigure, grid: pd.DataFrame, title: str) -> None:
    """Draw the tools of one designer on one task into `block`."""
    axes = block.subplots(*_size(grid), squeeze=False)
    for axis in axes.flat:
        axis.set_axis_off()
    for row in grid.to_dict("records"):
        axis = axes[row["row"], row["column"]]
        axis.set_axis_on()
        show(axis, row["picture"])
        axis.set_gid(f"instance {row['instance']}")
        if not row["success"]:
            for spine in axis.spines.values():
                spine.set(color=UNSOLVED_COLOUR, linewidth=UNSOLVED_WIDTH)
        if not is_map(grid):
            axis.set_xlabel(row["goal"], fontsize=FONT_SIZE, labelpad=1.5)
    block.suptitle(title, fontsize=7)
    if is_map(grid):
        block.supxlabel(rf"{grid['across'].iloc[0]} $\rightarrow$", fontsize=FONT_SIZE)
        block.supylabel(rf"{grid['up'].iloc[0]} $\rightarrow$", fontsize=FONT_SIZE)


def _size(grid: pd.DataFrame) -> tuple[int, int]:
    return int(grid["row"].max()) + 1, int(grid["column"].max()) + 1
