"""Learning curves as interquartile means: numbers by hand, intervals that hold them, none below three seeds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from codesign_bench.errors import UserError
from codesign_bench.registry import load_module

figure: Any = load_module("paper_figs", "learning_curves_iqm")


def curves(finals: list[float], *, steps: tuple[int, ...] = (0, 1000), method: str = "gnn_ppo") -> pd.DataFrame:
    """Return a cell per final return, that starts at 0 and succeeds a tenth as often as its return is high."""
    rows = [
        {"task": "push", "method": method, "variant": "default", "seed": seed, "env_steps": step, "return_mean": value}
        for seed, final in enumerate(finals)
        for step, value in zip(steps, [*[0.0] * (len(steps) - 1), final], strict=True)
    ]
    return pd.DataFrame(rows).assign(success_rate=lambda frame: frame["return_mean"] / 10)


def final(frame: pd.DataFrame, quantity: str = "return_mean") -> pd.Series:
    """Return the numbers at the last step."""
    table = figure.data(frame)
    return table[table["quantity"] == quantity].iloc[-1]


def test_one_seed_that_shines_does_not_move_the_line() -> None:
    row = final(curves([1.0, 2.0, 3.0, 100.0]))
    assert row["interquartile_mean"] == 2.5  # the mean of 2 and 3
    assert row["low"] <= 2.5 <= row["high"]
    assert row["seeds"] == 4
    assert final(curves([1.0, 2.0, 3.0, 100.0]), "success_rate")["interquartile_mean"] == pytest.approx(0.25)


def test_where_all_seeds_agree_the_interval_is_a_point() -> None:
    row = final(curves([2.0, 2.0, 2.0]))
    assert row[["low", "high"]].tolist() == [2.0, 2.0]


@pytest.mark.parametrize("seeds", [1, 2])
def test_no_interval_below_three_seeds(seeds: int) -> None:
    frame = curves([1.0, 3.0][:seeds])
    table = figure.data(frame)
    assert table[["low", "high"]].isna().all(axis=None)
    assert not figure.draw(frame).axes[0].collections


def test_a_seed_that_ended_early_counts_as_far_as_it_got() -> None:
    frame = curves([1.0, 2.0, 3.0], steps=(0, 1000, 2000))
    frame = frame[~((frame["seed"] == 2) & (frame["env_steps"] == 2000))]
    table = figure.data(frame)
    returns = table[table["quantity"] == "return_mean"].set_index("env_steps")
    assert returns["seeds"].to_dict() == {0: 3, 1000: 3, 2000: 2}
    assert returns.loc[2000, "interquartile_mean"] == pytest.approx(1.5)
    assert np.isnan(returns.loc[2000, "low"])


def test_line_and_band_are_the_numbers_and_the_same_in_every_call() -> None:
    frame = curves([1.0, 2.0, 4.0, 5.0, 6.0])
    first, again = final(frame), final(frame)
    assert first.tolist() == again.tolist()
    panel, *_ = figure.draw(frame).axes
    (line,) = [found for found in panel.lines if found.get_gid() == "gnn_ppo"]
    assert np.asarray(line.get_ydata())[-1] == first["interquartile_mean"]
    heights = np.asarray(panel.collections[0].get_paths()[0].vertices)
    ends = heights[heights[:, 0] == 1000.0, 1]
    assert (ends.min(), ends.max()) == (first["low"], first["high"])


def test_the_kind_of_interval_is_written_on_the_figure() -> None:
    (legend,) = figure.draw(curves([1.0, 2.0, 3.0])).legends
    assert "95% bootstrap interval" in legend.get_title().get_text()
    assert [text.get_text() for text in legend.get_texts()] == ["gnn_ppo (n=3)"]


def test_results_without_a_default_cell_say_so() -> None:
    with pytest.raises(UserError, match="no evaluated cell"):
        figure.draw(curves([1.0]).assign(variant="alpha-0.30"))
