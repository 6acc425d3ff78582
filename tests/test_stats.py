"""The statistics equal values computed by hand, and say nothing where there is too little to say."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

from codesign_bench import stats


def curve(
    seed: int, steps: list[int], values: list[float], *, method: str = "gnn_ppo", variant: str = "default"
) -> pd.DataFrame:
    """Return one curve as `load_results` would give it."""
    columns = {"task": "push", "method": method, "variant": variant, "seed": seed}
    return pd.DataFrame({"env_steps": steps, "return_mean": values, **columns}, index=range(len(steps)))


def test_mean_and_standard_error() -> None:
    # Variance ((1-3)^2 + 0 + (5-3)^2) / 2 = 4, so the standard error is sqrt(4 / 3).
    assert stats.mean([1.0, 3.0, 5.0]) == 3.0
    assert stats.standard_error([1.0, 3.0, 5.0]) == pytest.approx(math.sqrt(4.0 / 3.0))


def test_missing_values_are_left_out() -> None:
    assert stats.mean([1.0, math.nan, 3.0]) == 2.0
    assert math.isnan(stats.standard_error([1.0, math.nan, 3.0]))


def test_interquartile_mean_ignores_the_outer_quarters() -> None:
    assert stats.interquartile_mean([-1000.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 1000.0]) == 3.5


def test_nothing_is_said_about_no_values() -> None:
    assert math.isnan(stats.mean([]))
    assert math.isnan(stats.interquartile_mean([]))


@pytest.mark.parametrize("values", [[], [1.0], [1.0, 2.0]])
def test_no_spread_for_fewer_than_three_seeds(values: list[float]) -> None:
    assert math.isnan(stats.standard_error(values))
    assert all(math.isnan(end) for end in stats.bootstrap_interval(values, np.random.default_rng(0)))


def test_the_same_generator_gives_the_same_interval() -> None:
    values = np.random.default_rng(0).normal(size=20)
    intervals = [stats.bootstrap_interval(values, np.random.default_rng(seed)) for seed in (1, 1, 2)]
    assert intervals[0] == intervals[1] != intervals[2]


def test_the_interval_holds_the_point_estimate_and_narrows_with_less_confidence() -> None:
    values = [0.1, 0.4, 0.5, 0.7, 0.9, 1.0]
    low, high = stats.bootstrap_interval(values, np.random.default_rng(0))
    inner_low, inner_high = stats.bootstrap_interval(values, np.random.default_rng(0), confidence=0.5)
    assert min(values) <= low < inner_low < stats.interquartile_mean(values) < inner_high < high <= max(values)


def test_equal_values_have_an_interval_without_width() -> None:
    assert stats.bootstrap_interval([2.0] * 4, np.random.default_rng(0)) == (2.0, 2.0)


def test_the_interval_covers_the_centre_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(0)
    intervals = [stats.bootstrap_interval(rng.normal(size=30), rng, resamples=300) for _ in range(200)]
    covered = np.mean([low <= 0.0 <= high for low, high in intervals])
    assert 0.88 <= covered <= 0.99


def test_final_values_average_the_last_evaluations_of_each_curve() -> None:
    frame = pd.concat([curve(0, [20, 0, 10], [5.0, 1.0, 3.0]), curve(1, [0, 10], [2.0, 4.0])])
    assert stats.final_values(frame, "return_mean")["return_mean"].tolist() == [5.0, 4.0]
    averaged = stats.final_values(frame, "return_mean", last=2)
    assert averaged["return_mean"].tolist() == [4.0, 3.0]
    assert averaged["env_steps"].tolist() == [20, 10]


def test_a_seed_is_interpolated_between_its_evaluations() -> None:
    frame = pd.concat([curve(0, [0, 20], [0.0, 2.0]), curve(1, [0, 10, 20], [4.0, 4.0, 4.0])])
    grid = stats.on_common_grid(frame, "return_mean")
    first = grid[grid["seed"] == 0]
    assert first["env_steps"].tolist() == [0.0, 10.0, 20.0]
    assert first["return_mean"].tolist() == [0.0, 1.0, 2.0]


def test_a_seed_is_never_drawn_on_beyond_its_ends() -> None:
    frame = pd.concat([curve(0, [10, 20], [1.0, 2.0]), curve(1, [0, 40], [0.0, 4.0])])
    grid = stats.on_common_grid(frame, "return_mean")
    assert grid.loc[grid["seed"] == 0, "env_steps"].tolist() == [10.0, 20.0]
    assert grid.loc[grid["seed"] == 1, "env_steps"].tolist() == [0.0, 10.0, 20.0, 40.0]


def test_groups_do_not_share_a_grid() -> None:
    frame = pd.concat([curve(0, [0, 10], [0.0, 1.0]), curve(0, [0, 5, 10], [0.0, 3.0, 1.0], variant="alpha-0.30")])
    grid = stats.on_common_grid(frame, "return_mean")
    assert grid.loc[grid["variant"] == "default", "env_steps"].tolist() == [0.0, 10.0]


def test_missing_evaluations_are_bridged() -> None:
    grid = stats.on_common_grid(curve(0, [0, 10, 20], [0.0, math.nan, 2.0]), "return_mean")
    assert grid["env_steps"].tolist() == [0.0, 20.0]


def test_curve_statistics_count_the_seeds_at_each_step() -> None:
    curves = [curve(0, [0, 10], [1.0, 1.0]), curve(1, [0, 10], [3.0, 3.0]), curve(2, [0, 10, 20], [5.0, 5.0, 9.0])]
    table = stats.curve_statistics(pd.concat(curves), "return_mean")
    assert table["seeds"].tolist() == [3, 3, 1]
    assert table["mean"].tolist() == [3.0, 3.0, 9.0]
    assert table["standard_error"].tolist() == pytest.approx([math.sqrt(4.0 / 3.0)] * 2 + [math.nan], nan_ok=True)


def test_an_empty_frame_stays_empty() -> None:
    empty = curve(0, [], [])
    assert stats.on_common_grid(empty, "return_mean").empty
    assert stats.curve_statistics(empty, "return_mean").empty
