"""Learning curves of the tutorial's study: one colour for each number of instances, one thin line for each seed."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

TITLE = "Practice on more instances"
NEEDS = "codesign-bench reproduce --study practice"
COLOURS = ("tab:orange", "tab:blue")


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the curves of all cells that vary the practice."""
    return frame.dropna(subset=["practice"])[["task", "practice", "seed", "env_steps", "return_mean"]]


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure."""
    figure = Figure(figsize=(6, 4), layout="constrained")
    axes = figure.subplots()
    for colour, (practice, curves) in zip(COLOURS, data(frame).groupby("practice"), strict=True):
        for _, curve in curves.groupby(["task", "seed"]):
            axes.plot(curve["env_steps"], curve["return_mean"], colour, linewidth=0.7)
        mean = curves.groupby("seed")["return_mean"].last().mean()
        axes.plot([], [], colour, label=f"instances: {practice:g}, final return {mean:.2f}")
    axes.set(xlabel="environment steps", ylabel="return on the evaluation instances")
    axes.legend()
    return figure
