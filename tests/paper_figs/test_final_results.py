"""The table of final values, by numbers that can be checked by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest

from codesign_bench.errors import UserError
from codesign_bench.registry import load_module
from codesign_bench.report.final_values import estimate

figure: Any = load_module("paper_figs", "final_results")


def cells(method: str, finals: list[float], task: str = "push", variant: str = "default") -> pd.DataFrame:
    """Return one cell per final return, each with an evaluation before it; half an hour, success a tenth of return."""
    rows = [
        {
            "task": task,
            "method": method,
            "variant": variant,
            "seed": seed,
            "env_steps": steps,
            "return_mean": value,
            "success_rate": value / 10.0,
            "wall_s": 1800.0 * steps / 1000,
        }
        for seed, final in enumerate(finals)
        for steps, value in ((0, -5.0), (1000, final))
    ]
    return pd.DataFrame(rows)


def test_the_last_evaluation_counts() -> None:
    (row,) = figure.data(cells("gnn_ppo", [1.0, 2.0, 6.0])).to_dict("records")
    assert (row["seeds"], row["env_steps"], row["minutes"]) == (3, 1000.0, 30.0)
    assert row["return_mean"] == pytest.approx(3.0)
    assert row["success_rate"] == pytest.approx(0.3)
    # A standard deviation of sqrt 7 over three seeds; success cannot be below 0.
    half = 4.302653 * np.sqrt(7.0 / 3.0)
    assert (row["return_mean_low"], row["return_mean_high"]) == pytest.approx((3.0 - half, 3.0 + half), rel=1e-6)
    assert (row["success_rate_low"], row["success_rate_high"]) == pytest.approx((0.0, 0.3 + 0.1 * half), rel=1e-6)


def test_a_cell_that_had_to_share_its_core_leaves_the_minutes_alone() -> None:
    frame = cells("gnn_ppo", [1.0, 2.0, 6.0])
    frame.loc[frame["seed"] == 1, "wall_s"] *= 9.0
    (row,) = figure.data(frame).to_dict("records")
    assert row["minutes"] == 30.0


def test_the_report_gives_the_same_intervals() -> None:
    finals = [1.0, 2.0, 6.0, 7.0, 7.5]
    (row,) = figure.data(cells("gnn_ppo", finals)).to_dict("records")
    told = estimate(finals)
    assert (row["return_mean_low"], row["return_mean_high"]) == (told.low, told.high)


def test_two_seeds_have_no_interval() -> None:
    frame = cells("gnn_ppo", [1.0, 2.0])
    (row,) = figure.data(frame).to_dict("records")
    assert np.isnan(row["return_mean_low"])
    assert "| push | gnn_ppo | 2 | 1,000 | 1.50 | 0.15 | 30.0 |" in figure.texts(frame)["md"]


def test_a_seed_that_stopped_early_does_not_count() -> None:
    early = cells("gnn_ppo", [9.0] * 4)
    early = early[(early["seed"] == 3)].assign(env_steps=lambda rows: rows["env_steps"] // 2)
    (row,) = figure.data(pd.concat([cells("gnn_ppo", [1.0] * 3), early])).to_dict("records")
    assert (row["seeds"], row["return_mean"]) == (3, 1.0)


def test_methods_stand_in_the_papers_order_and_other_variants_are_left_out() -> None:
    parts = [cells(name, [1.0] * 3) for name in ("cma_es", "gnn_ppo")]
    table = figure.data(pd.concat([*parts, cells("gnn_ppo", [9.0], variant="alpha-0.30")]))
    assert table["method"].tolist() == ["gnn_ppo", "cma_es"]
    assert table["return_mean"].max() == 1.0


def test_the_picture_shows_the_table() -> None:
    finals = [5.0, 6.0, 7.0]
    frame = pd.concat([cells("gnn_ppo", finals), cells("cma_rl", [2.0] * 3), cells("gnn_ppo", [8.0], task="scoop")])
    drawn = {axes.get_title(): axes for axes in figure.draw(frame).axes if axes.get_visible()}
    assert set(drawn) == {"push", "scoop"}
    dots = [line for line in drawn["push"].lines if line.get_marker() == "o"]
    places = {line.get_gid(): line.get_xdata()[0] for line in dots if line.get_gid()}
    assert places == pytest.approx({"gnn_ppo": 0.6, "cma_rl": 0.2})
    seeds = [list(line.get_xdata()) for line in dots if not line.get_gid()]
    assert seeds == [pytest.approx([0.5, 0.6, 0.7]), pytest.approx([0.2] * 3)]
    assert [text.get_text() for text in drawn["push"].get_yticklabels()] == ["gnn_ppo (3)", "cma_rl (3)"]


def test_a_method_has_one_colour_whatever_else_a_panel_shows() -> None:
    frame = pd.concat([cells("zeta", [5.0]), cells("alpha", [2.0]), cells("zeta", [8.0], task="scoop")])
    dots = [line for axes in figure.draw(frame).axes if axes.get_visible() for line in axes.lines if line.get_gid()]
    colours = {(line.get_gid(), line.get_color()) for line in dots}
    assert len(dots) == 3
    assert len(colours) == len({colour for _, colour in colours}) == 2


def test_the_same_results_give_the_same_intervals() -> None:
    frame = cells("gnn_ppo", [1.0, 2.0, 6.0])
    pd.testing.assert_frame_equal(figure.data(frame), figure.data(frame))


def referenced(frame: pd.DataFrame, idle: float, best_known: float) -> pd.DataFrame:
    """Return a task's cells with the two ends of its scale."""
    columns = {"reference_idle_return_mean": idle, "reference_best_known_return_mean": best_known}
    return frame.assign(**columns, reference_idle_success_rate=0.0, reference_best_known_success_rate=1.0)


def test_a_normalised_score_is_0_for_idling_and_1_for_the_best_known() -> None:
    (row,) = figure.data(referenced(cells("gnn_ppo", [1.0, 2.0, 6.0]), -1.0, 7.0)).to_dict("records")
    assert row["normalized_score"] == pytest.approx((3.0 + 1.0) / 8.0)
    assert row["normalized_score_low"] == pytest.approx((row["return_mean_low"] + 1.0) / 8.0)
    assert row["normalized_score_high"] == pytest.approx((row["return_mean_high"] + 1.0) / 8.0)


def test_the_late_gain_is_what_the_mean_curve_gains_in_its_last_third_in_units_of_the_score() -> None:
    rising = [{"env_steps": 100 * step, "return_mean": float(step)} for step in range(10)]
    start = cells("gnn_ppo", [0.0]).iloc[:1]
    frame = pd.concat([start.assign(**point) for point in rising])
    (row,) = figure.data(referenced(frame, -1.0, 7.0)).to_dict("records")
    assert row["late_gain"] == pytest.approx(3.0 / 8.0)
    assert "| 1.25 | +0.38 |" in figure.texts(referenced(frame, -1.0, 7.0))["md"]


def test_without_reference_points_there_is_no_score() -> None:
    frame = pd.concat([cells("gnn_ppo", [1.0] * 3), cells("gnn_ppo", [1.0] * 3, task="scoop")])
    table = figure.data(frame)
    assert table[["normalized_score", "late_gain"]].isna().all(axis=None)
    assert table["task"].tolist() == ["push", "scoop"]
    assert not any(name in figure.texts(frame)["md"] for name in figure.OF_SCORE)


def test_normalised_scores_alone_are_averaged_over_the_tasks_that_have_them() -> None:
    frame = pd.concat(
        [
            referenced(cells("gnn_ppo", [0.0, 1.0, 2.0]), 0.0, 2.0),
            referenced(cells("gnn_ppo", [30.0] * 4, task="scoop"), 20.0, 30.0),
            cells("gnn_ppo", [9.0] * 3, task="lift_cup"),
            referenced(cells("cma_rl", [2.0] * 3), 0.0, 2.0),
        ]
    )
    table = figure.data(frame)
    (row,) = table[table["task"] == "average"].to_dict("records")
    assert row["method"] == "gnn_ppo", "cma_rl has no result on scoop"
    # Scores 0, 0.5 and 1 of one task, half of whose standard error is that of the average: sqrt(1 / 12) / 2.
    half = 4.302653 * math.sqrt(1.0 / 12.0) / 2.0
    ends = (row["normalized_score_low"], row["normalized_score_high"])
    assert row["normalized_score"] == 0.75
    assert ends == pytest.approx((0.75 - half, 0.75 + half), rel=1e-6)
    assert (row["seeds"], row["env_steps"]) == (3, 1000.0)
    assert np.isnan(row["return_mean"])
    assert np.isnan(row["success_rate"])
    text = figure.texts(frame)["md"]
    assert "| average of 2 tasks | gnn_ppo | 3 | 1,000 | - | - | 0.75 [0.13, 1.37] | - | - |" in text
    assert "| lift cup | gnn_ppo | 3 | 1,000 | 9.00 | 0.90 | - | - | 30.0 |" in text
    shown = {axes.get_title() for axes in figure.draw(frame).axes if axes.get_visible()}
    assert shown == {"push", "scoop", "lift cup"}


def test_the_table_of_success_has_the_steps_spent() -> None:
    frame = pd.concat([cells("gnn_ppo", [1.0] * 3), cells("cma_rl", [2.0] * 3)])
    told = "| push | 3 | {} | 0.10 | 0.20 |"
    assert told.format("1k") in figure.success_by_task(figure.data(frame))
    frame.loc[frame["method"] == "cma_rl", "env_steps"] *= 2
    assert told.format("1k-2k") in figure.success_by_task(figure.data(frame))


def test_without_curves_the_way_to_them_is_told() -> None:
    with pytest.raises(UserError, match="no evaluated cell"):
        figure.data(cells("gnn_ppo", [1.0], variant="alpha-0.30"))
