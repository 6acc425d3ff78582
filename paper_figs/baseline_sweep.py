"""The sweep over the settings of the CMA-ES baseline, with our best values and the paper's (its appendix)."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from codesign_bench.storage.frames import require_columns
from codesign_bench.studies.corl2023.baseline_sweep import load_sweep
from codesign_bench.text_tables import latex, markdown

from ._style import BLUE, PAGE_WIDTH, RED, style

TITLE = "Sweep of the CMA-ES baseline"
SOURCE = load_sweep
NEEDS = "codesign-bench reproduce baseline_sweep"
PARAMETERS = {
    "popsize": "population size",
    "sigma0": "initial deviation",
    "center_learning_rate": "centre learning rate",
    "covariance_learning_rate": "covariance learning rate",
    "rank_mu_learning_rate": "rank-mu learning rate",
    "rank_one_learning_rate": "rank-one learning rate",
}
"""Swept columns and their names on the axes, as in the paper's table."""
NEEDED = (*PARAMETERS, "rung", "budget", "paper_best", "env_steps", "return_mean", "kept")
CHOSEN_COLOUR, PAPER_COLOUR = RED, BLUE


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the frame's rows with a column `chosen`: 1 for the best setting of the last rung, in every rung.

    Args:
        frame: one row per setting and rung, with the columns `NEEDED`.

    Raises:
        UserError: a column is missing, or there is no row.
    """
    require_columns(frame, NEEDED, "the settings tried")
    best = _chosen(frame)
    same = np.logical_and.reduce([frame[name] == best[name] for name in PARAMETERS])
    return frame.assign(chosen=same.astype(int))


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure: a panel per parameter, every setting a dot at its value and return, later rungs larger.

    Raises:
        UserError: as `data` does.
    """
    table = data(frame)
    with style():
        figure = Figure(figsize=(PAGE_WIDTH, 3.4), layout="constrained")
        axes = figure.subplots(2, 3, sharey=True)
        for axis, (name, label) in zip(axes.flat, PARAMETERS.items(), strict=True):
            _draw_panel(axis, table, name)
            axis.set_xlabel(label)
        for axis in axes[:, 0]:
            axis.set_ylabel("mean return")
        handles = [
            Line2D([], [], marker="o", linestyle="", color="#999999", label=f"a setting (n={_count(table)}, one seed)"),
            Line2D([], [], marker="D", linestyle="", color=CHOSEN_COLOUR, label="chosen"),
            Line2D([], [], marker="s", linestyle="", color=PAPER_COLOUR, label="best of the paper"),
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=3, title="larger dots: larger budgets")
        figure.draw_without_rendering()
    return figure


def texts(frame: pd.DataFrame) -> dict[str, str]:
    """Return the table of our best values and the paper's, in Markdown and LaTeX.

    Raises:
        UserError: as `data` does.
    """
    table = data(frame)
    chosen, paper = _chosen(table), table[table["paper_best"] == 1].iloc[0]
    header = ["hyperparameter", "tested", "chosen here", "best of the paper"]
    rows = [
        [label, ", ".join(f"{value:g}" for value in sorted(set(table[name]))), f"{chosen[name]:g}", f"{paper[name]:g}"]
        for name, label in PARAMETERS.items()
    ]
    return {"md": markdown(header, rows), "tex": latex(header, rows)}


def _chosen(frame: pd.DataFrame) -> pd.Series:
    last = frame[frame["rung"] == frame["rung"].max()]
    return last.loc[last["return_mean"].idxmax()]


def _count(table: pd.DataFrame) -> int:
    return int((table["rung"] == 0).sum())


def _draw_panel(axes: Axes, table: pd.DataFrame, name: str) -> None:
    """Draw every setting's return over one parameter, with rungs slightly offset at each value."""
    values = sorted(set(table[name]))
    place = table[name].map({value: index for index, value in enumerate(values)}).to_numpy(dtype=float)
    rungs = int(table["rung"].max()) + 1
    place = place + 0.5 * (table["rung"].to_numpy(dtype=float) + 0.5) / rungs - 0.25
    size = 4.0 + 8.0 * table["rung"].to_numpy(dtype=float)
    plain = ((table["chosen"] == 0) & (table["paper_best"] == 0)).to_numpy()
    returns = table["return_mean"].to_numpy(dtype=float)
    axes.scatter(place[plain], returns[plain], s=size[plain], color="#999999", alpha=0.6, linewidths=0)
    for column, colour, marker in (("paper_best", PAPER_COLOUR, "s"), ("chosen", CHOSEN_COLOUR, "D")):
        mask = (table[column] == 1).to_numpy()
        axes.scatter(
            place[mask], returns[mask], s=size[mask] + 6.0, color=colour, marker=marker, linewidths=0, zorder=3
        )
    axes.set_xticks(range(len(values)), [f"{value:g}" for value in values])
