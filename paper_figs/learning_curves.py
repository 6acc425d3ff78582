"""Learning curves of every method on every task (the paper's figure `fig:sample_efficiency`).

The paper's claim: "Across all tasks, our framework achieves improved performance and sample efficiency." Lines are
means over seeds and bands the standard error, as in the paper; the success rates below are ours.
"""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from codesign_bench.figures.source import curves
from codesign_bench.stats import MIN_SEEDS, curve_statistics

from ._curves import QUANTITIES, draw_curves, evaluated_rows, method_labels, seed_curves

TITLE = "Learning curves"
SOURCE = curves
NEEDS = "codesign-bench run --method all --task T --seeds 6"
COMPARES = True
"""Whether `plot --compare` adds the curves of other results."""

INTERVAL = (
    "line: mean over seeds; dotted: not all seeds got this far; thin lines: each seed\n"
    f"band: ± standard error, if {MIN_SEEDS} seeds or more"
)
"""The kind of interval, written on the figure."""


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the numbers that the figure shows.

    Args:
        frame: rows as `codesign_bench.load_results` gives them; variants other than `default` are left out.

    Returns:
        Columns task, method, quantity ("return_mean" or "success_rate"), env_steps, mean, standard_error (NaN for
        fewer than three seeds), seeds (how many reached this step).

    Raises:
        UserError: a column, or every row of the default variant, is missing.
    """
    rows = evaluated_rows(frame)
    tables = [curve_statistics(rows, quantity).assign(quantity=quantity) for quantity in QUANTITIES]
    columns = ["task", "method", "quantity", "env_steps", "mean", "standard_error", "seeds"]
    return pd.concat(tables, ignore_index=True)[columns]


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure: for each task a panel of returns above one of success rates, and one legend with seed counts.

    Args:
        frame: rows as `codesign_bench.load_results` gives them; a column `label` names the methods in the legend.

    Raises:
        UserError: as `data` does.
    """
    table = data(frame)
    low, high = table["mean"] - table["standard_error"], table["mean"] + table["standard_error"]
    shown = table.assign(centre=table["mean"], low=low, high=high)
    return draw_curves(shown, seed_curves(evaluated_rows(frame)), method_labels(frame), INTERVAL)
