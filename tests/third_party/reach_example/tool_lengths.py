"""Length of the designed link over the distance of the goal: does the designer fit the tool to its goal?

Each dot is the tool for one evaluation instance; on the dashed line the tip just reaches the goal.
"""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from codesign_bench.errors import UserError
from codesign_bench.figures.source import evaluations
from codesign_bench.storage.frames import default_rows

TITLE = "Designed lengths"
SOURCE = evaluations
NEEDS = "codesign-bench reproduce --study fitting_lengths"
COLUMNS = ["method", "seed", "instance_goal_distance", "design_length", "return"]


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the numbers that the figure shows: one row per evaluation instance of each default cell of `reach`.

    Raises:
        UserError: there is no such cell.
    """
    rows = default_rows(frame[frame["task"] == "reach"])
    if rows.empty:
        raise UserError("no finished cell of reach")
    return rows[COLUMNS].reset_index(drop=True)


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure: one colour per method.

    Raises:
        UserError: as `data` does.
    """
    table = data(frame)
    figure = Figure(figsize=(3.4, 2.6), layout="constrained")
    axes = figure.subplots()
    for method, part in table.groupby("method"):
        axes.plot(part["instance_goal_distance"], part["design_length"], ".", markersize=3, label=str(method))
    ends = [table["instance_goal_distance"].min(), table["instance_goal_distance"].max()]
    axes.plot(ends, ends, "--", color="0.5", linewidth=0.8)
    axes.set_xlabel("distance of the goal (m)")
    axes.set_ylabel("length of the link (m)")
    axes.legend()
    return figure
