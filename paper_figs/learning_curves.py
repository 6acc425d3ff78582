"""Learning curves of every method on every task (the paper's figure `fig:sample_efficiency`).

The paper's claim: "Across all tasks, our framework achieves improved performance and sample efficiency." Lines are
means over seeds and bands the standard error, as in the paper; the success rates below are ours. Grey lines are
reference points, which need no learning: see `docs/reference_points.md`.
"""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from codesign_bench.figures.source import curves_with_references
from codesign_bench.stats import MIN_SEEDS, curve_statistics
from codesign_bench.storage.reference_points import reference_points_in

from ._curves import QUANTITIES, draw_curves, evaluated_rows, method_labels, reference_texts, seed_curves

TITLE = "Learning curves"
SOURCE = curves_with_references
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
        frame: rows of `codesign_bench.load_results`; variants other than `default` are left out.

    Returns:
        Columns task, method, quantity ("return_mean" or "success_rate"), env_steps, mean, standard_error (NaN for
        fewer than three seeds), seeds (the number that reached this step).

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
        frame: rows of `codesign_bench.load_results`; a column `label` names the methods in the legend.

    Raises:
        UserError: as `data` does.
    """
    table = data(frame)
    low, high = table["mean"] - table["standard_error"], table["mean"] + table["standard_error"]
    rows = evaluated_rows(frame)
    return draw_curves(
        table.assign(centre=table["mean"], low=low, high=high),
        method_labels(frame),
        INTERVAL,
        reference_points_in(rows),
        seed_curves(rows),
    )


def texts(frame: pd.DataFrame) -> dict[str, str]:
    """Return the values of the grey lines as a further CSV file, if the results have any.

    Raises:
        UserError: as `data` does.
    """
    return reference_texts(evaluated_rows(frame))
