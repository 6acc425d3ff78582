"""The tasks as pictures: a moment of each task's script at work (the paper's figure of its simulated environments)."""

from __future__ import annotations

import math

import pandas as pd
from matplotlib.figure import Figure

from codesign_bench.figures.task_pictures import tasks_at_work
from codesign_bench.storage.frames import require_columns

from ._order import in_task_order
from ._pictures import cut_to_content, show
from ._style import COLUMN_WIDTH, PAGE_WIDTH, style

TITLE = "Tasks"
SOURCE = tasks_at_work
NEEDED = ("task", "title", "instance", "step", "steps", "return", "success", "picture")
PICTURES_PER_ROW = 3
TITLE_HEIGHT = 0.2
"""Room for a title, in inches."""


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the data of each picture.

    Args:
        frame: one row per task with the columns `NEEDED`.

    Returns:
        The same rows without pictures, in the paper's order.

    Raises:
        UserError: a column is missing, or there is no row.
    """
    return _rows(frame).drop(columns="picture")


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure: one picture per task under its title.

    Raises:
        UserError: as `data` does.
    """
    rows = _rows(frame)
    columns = min(PICTURES_PER_ROW, len(rows))
    lines = math.ceil(len(rows) / columns)
    width = COLUMN_WIDTH if columns == 1 else PAGE_WIDTH
    pictures = [cut_to_content(picture) for picture in rows["picture"]]
    shapes = [picture.shape[0] / picture.shape[1] for picture in pictures]
    heights = [max(shapes[line * columns : (line + 1) * columns]) * width / columns for line in range(lines)]
    with style():
        figure = Figure(figsize=(width, sum(heights) + TITLE_HEIGHT * lines), layout="constrained")
        axes = figure.subplots(lines, columns, squeeze=False, height_ratios=heights)
        for axis in axes.flat[len(rows) :]:
            axis.set_axis_off()
        for axis, picture, title in zip(axes.flat[:], pictures, rows["title"], strict=False):
            show(axis, picture)
            axis.set_anchor("N")
            axis.set_title(title)
        figure.draw_without_rendering()
    return figure


def _rows(frame: pd.DataFrame) -> pd.DataFrame:
    require_columns(frame, NEEDED, "the pictures")
    return in_task_order(frame)
