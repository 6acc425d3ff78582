"""Learning curves as interquartile means with bootstrap intervals over seeds (Agarwal et al. 2021).

The same curves as in `learning_curves`, but robust to single seeds with very low or high returns.
"""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from codesign_bench.figures.source import curves_with_references
from codesign_bench.seeding import generator
from codesign_bench.stats import CONFIDENCE, MIN_SEEDS, curve_intervals
from codesign_bench.storage.reference_points import reference_points_in

from ._curves import QUANTITIES, draw_curves, evaluated_rows, method_labels, reference_texts

TITLE = "Learning curves, interquartile mean"
SOURCE = curves_with_references
NEEDS = "codesign-bench run --method all --task T --seeds 6"
COMPARES = True
"""Whether `plot --compare` adds the curves of other results."""

INTERVAL = (
    "line: interquartile mean over seeds; dotted: not all seeds got this far\n"
    f"band: {CONFIDENCE:.0%} bootstrap interval over seeds, if {MIN_SEEDS} or more"
)
"""The kind of interval, written on the figure."""


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the numbers that the figure shows, the same in every call.

    Args:
        frame: rows of `codesign_bench.load_results`; variants other than `default` are left out.

    Returns:
        Columns task, method, quantity ("return_mean" or "success_rate"), env_steps, interquartile_mean, low, high (NaN
        for fewer than three seeds), seeds (the number that reached this step).

    Raises:
        UserError: a column, or every row of the default variant, is missing.
    """
    rows, rng = evaluated_rows(frame), generator(0, "learning_curves_iqm")
    tables = [curve_intervals(rows, quantity, rng).assign(quantity=quantity) for quantity in QUANTITIES]
    columns = ["task", "method", "quantity", "env_steps", "interquartile_mean", "low", "high", "seeds"]
    return pd.concat(tables, ignore_index=True)[columns]


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure: for each task a panel of returns above one of success rates, and one legend with seed counts.

    Args:
        frame: rows of `codesign_bench.load_results`; a column `label` names the methods in the legend.

    Raises:
        UserError: as `data` does.
    """
    table = data(frame).rename(columns={"interquartile_mean": "centre"})
    return draw_curves(table, method_labels(frame), INTERVAL, reference_points_in(evaluated_rows(frame)))


def texts(frame: pd.DataFrame) -> dict[str, str]:
    """Return the values of the grey lines as a further CSV file, if the results have any.

    Raises:
        UserError: as `data` does.
    """
    return reference_texts(evaluated_rows(frame))
