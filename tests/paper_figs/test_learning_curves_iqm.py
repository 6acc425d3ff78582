"""Interquartile means over tasks and seeds: numbers by hand, intervals that hold them, none below three seeds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import pytest

from codesign_bench.errors import UserError
from codesign_bench.registry import load_module

figure: Any = load_module("paper_figs", "learning_curves_iqm")


def curves(
    finals: Sequence[float], *, task: str = "push", method: str = "gnn_ppo", steps: tuple[int, ...] = (0, 1000)
) -> pd.DataFrame:
    """Return a cell per final success, whose success rises in a straight line from 0."""
    rows = [
        {"task": task, "method": method, "variant": "default", "seed": seed, "env_steps": step, "return_mean": 0.0}
        | {"success_rate": final * step / steps[-1]}
        for seed, final in enumerate(finals)
        for step in steps
    ]
    return pd.DataFrame(rows)


def two_tasks() -> pd.DataFrame:
    """Return three seeds on each of two tasks, whose budgets differ."""
    return pd.concat([curves([0.1, 0.2, 0.3]), curves([0.5, 0.6, 0.8], task="scoop", steps=(0, 300, 600))])


def test_the_outer_quarters_of_tasks_and_seeds_together_are_left_out() -> None:
    table = figure.data(two_tasks()).set_index("share")
    # Six curves: one is left out on either side.
    assert table.loc[1.0, "interquartile_mean"] == pytest.approx((0.2 + 0.3 + 0.5 + 0.6) / 4)
    assert table.loc[0.5, "interquartile_mean"] == pytest.approx((0.2 + 0.3 + 0.5 + 0.6) / 8)
    assert table.loc[0.0, "interquartile_mean"] == 0.0
    assert table.loc[1.0, ["tasks", "seeds"]].tolist() == [2, 6]
    assert table.loc[1.0, "low"] < table.loc[1.0, "interquartile_mean"] < table.loc[1.0, "high"]


def test_methods_are_compared_on_the_tasks_that_all_have() -> None:
    frame = pd.concat([two_tasks(), curves([0.0, 0.1, 0.2], method="cma_rl")])
    table = figure.data(frame)
    assert set(table["tasks"]) == {1}
    end = table[table["share"] == 1.0].set_index("method")["interquartile_mean"]
    assert end.to_dict() == pytest.approx({"gnn_ppo": 0.2, "cma_rl": 0.1})
    with pytest.raises(UserError, match="no task on which every method"):
        figure.data(pd.concat([curves([0.1]), curves([0.1], task="scoop", method="cma_rl")]))


def test_no_interval_if_a_task_has_fewer_than_three_seeds() -> None:
    frame = pd.concat([curves([0.1, 0.2, 0.3]), curves([0.5, 0.6], task="scoop")])
    assert figure.data(frame)[["low", "high"]].isna().all(axis=None)
    assert not figure.draw(frame).axes[0].collections


def test_a_seed_that_ended_early_does_not_count() -> None:
    early = curves([0.9] * 4, steps=(0, 500))
    frame = pd.concat([curves([0.1, 0.2, 0.3]), early[early["seed"] == 3]])
    assert set(figure.data(frame)["seeds"]) == {3}


def test_line_and_band_are_the_numbers_and_the_same_in_every_call() -> None:
    frame = two_tasks()
    table, again = figure.data(frame), figure.data(frame)
    pd.testing.assert_frame_equal(table, again)
    (panel,) = figure.draw(frame).axes
    (line,) = [found for found in panel.lines if found.get_gid() == "gnn_ppo"]
    assert np.asarray(line.get_ydata()).tolist() == table["interquartile_mean"].tolist()
    heights = np.asarray(panel.collections[0].get_paths()[0].vertices)
    ends = heights[heights[:, 0] == 1.0, 1]
    assert (ends.min(), ends.max()) == (table["low"].iloc[-1], table["high"].iloc[-1])


def test_the_kind_of_interval_is_written_on_the_figure() -> None:
    (legend,) = figure.draw(two_tasks()).legends
    assert "95% bootstrap interval, seeds resampled within tasks" in legend.get_title().get_text()
    assert [text.get_text() for text in legend.get_texts()] == ["gnn_ppo (n=6)"]


def test_results_without_a_default_cell_say_so() -> None:
    with pytest.raises(UserError, match="no evaluated cell"):
        figure.draw(curves([1.0]).assign(variant="alpha-0.30"))


def test_the_legend_fits_in_the_figure() -> None:
    methods = ("gnn_ppo", "shared_arch", "cma_rl", "hwasp_minimal", "cma_es")
    frame = pd.concat(
        [curves([0.1, 0.2, 0.3], method=name).assign(label="GNN-PPO, separate credit") for name in methods]
    )
    drawn = figure.draw(frame)
    (legend,) = drawn.legends
    box = legend.get_window_extent()
    assert drawn.bbox.x0 <= box.x0
    assert box.x1 <= drawn.bbox.x1
