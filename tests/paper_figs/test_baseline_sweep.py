"""The figure of the baseline's sweep: which setting is chosen, and what stands beside it."""

from __future__ import annotations

from typing import Any

import pandas as pd
import pytest

from codesign_bench.errors import UserError
from codesign_bench.registry import load_module

figure: Any = load_module("paper_figs", "baseline_sweep")


def table() -> pd.DataFrame:
    """Return three settings, the first the paper's, of which two reach a second rung; the third wins there."""
    columns = [*figure.PARAMETERS, "rung", "budget", "paper_best", "env_steps", "return_mean", "kept"]
    rates = (1.0, 1.0, 1.0, 1.0)
    return pd.DataFrame(
        [
            (24, 0.1, *rates, 0, 100, 1, 100, 0.3, 1),
            (10, 1.0, *rates, 0, 100, 0, 100, 0.9, 0),
            (100, 0.1, *rates, 0, 100, 0, 100, 0.2, 1),
            (24, 0.1, *rates, 1, 300, 1, 300, 0.4, 0),
            (100, 0.1, *rates, 1, 300, 0, 300, 0.5, 1),
        ],
        columns=columns,
    )


def test_the_best_of_the_last_rung_is_chosen() -> None:
    chosen = figure.data(table())
    assert chosen.loc[chosen["chosen"] == 1, "popsize"].tolist() == [100, 100]
    assert chosen.loc[chosen["chosen"] == 1, "rung"].tolist() == [0, 1]


def test_the_text_names_the_chosen_value_beside_the_papers() -> None:
    texts = figure.texts(table())
    assert "| population size | 10, 24, 100 | 100 | 24 |" in texts["md"]
    assert r"initial deviation & 0.1, 1 & 0.1 & 0.1 \\" in texts["tex"]


def test_every_parameter_has_a_panel_with_every_setting() -> None:
    drawn = figure.draw(table())
    panels = [axes for axes in drawn.axes if axes.get_xlabel()]
    assert [axes.get_xlabel() for axes in panels] == list(figure.PARAMETERS.values())
    assert all(sum(len(points.get_offsets()) for points in axes.collections) == 5 for axes in panels)
    (legend,) = drawn.legends
    assert "n=3" in legend.get_texts()[0].get_text()


def test_a_table_without_rows_or_columns_is_refused() -> None:
    with pytest.raises(UserError, match="have no rows"):
        figure.data(table().iloc[:0])
    with pytest.raises(UserError, match="lack the column kept"):
        figure.data(table().drop(columns="kept"))
