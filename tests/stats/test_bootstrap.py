"""The statistics equal values computed by hand, and say nothing where there is too little to say."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import trim_mean

from codesign_bench import stats

pytestmark = pytest.mark.numeric


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


def test_intervals_of_means_and_of_their_difference() -> None:
    rng = np.random.default_rng(0)
    low, high = stats.mean_interval([0.0, 1.0, 5.0], rng)
    # All three seeds drawn alike has probability 1 / 27 > 0.025 for each: the ends are the outermost values.
    assert (low, high) == (0.0, 5.0)
    # Of the 27 equally likely draws, 7 add up to 2 or less and 4 to less, 23 to 10 or less and 20 to less.
    assert stats.mean_interval([0.0, 1.0, 5.0], rng, confidence=0.6) == pytest.approx((2.0 / 3.0, 10.0 / 3.0))
    assert stats.mean_difference_interval([2.0, 2.0, 2.0], [0.5, 0.5, 0.5, 0.5], rng) == (1.5, 1.5)


def test_rows_that_belong_together_stay_together() -> None:
    pairs = np.array([[1.0, 10.0], [2.0, 20.0], [3.0, 30.0]])
    low, high = stats.bootstrap(
        [pairs], lambda x: x[..., 1].mean(axis=1) / x[..., 0].mean(axis=1), np.random.default_rng(0)
    )
    assert (float(low), float(high)) == pytest.approx((10.0, 10.0))


def test_a_statistic_may_be_infinite() -> None:
    def first_or_never(seeds: np.ndarray) -> np.ndarray:
        return np.where(seeds.min(axis=1) > 0.0, seeds.min(axis=1), math.inf)

    assert stats.bootstrap([[0.0, 1.0, 2.0]], first_or_never, np.random.default_rng(0)) == (1.0, math.inf)


def test_probability_of_improvement_by_hand() -> None:
    # 1 is above 0, below 2 and equal to 1; 3 is above all three: 1 + 0 + 1/2 + 3 of 6 pairs.
    assert stats.probability_of_improvement([([1.0, 3.0], [0.0, 1.0, 2.0])]) == pytest.approx(0.75)
    assert stats.probability_of_improvement([([1.0], [1.0])]) == 0.5
    # Tasks weigh alike, however many seeds they have.
    assert stats.probability_of_improvement([([1.0] * 9, [0.0] * 9), ([0.0], [1.0])]) == 0.5


def test_probability_of_improvement_of_swapped_methods_adds_up_to_one() -> None:
    first, second = np.random.default_rng(0).normal(size=(2, 6))
    one = stats.probability_of_improvement([(first, second)])
    assert one + stats.probability_of_improvement([(second, first)]) == pytest.approx(1.0)
    low, high = stats.probability_of_improvement_interval([(first, second)], np.random.default_rng(0))
    assert 0.0 <= low < one < high <= 1.0


def test_a_performance_profile_is_the_share_of_seeds_above_each_threshold() -> None:
    profile = stats.performance_profile([[0.0, 1.0, 2.0, 2.0], [1.0]], [-1.0, 0.0, 1.0, 2.0])
    assert profile.tolist() == [1.0, (0.75 + 1.0) / 2.0, (0.5 + 0.0) / 2.0, 0.0]
    low, high = stats.performance_profile_interval([[0.0, 1.0, 2.0]], [-1.0, 0.5, 3.0], np.random.default_rng(0))
    assert (low.tolist(), high.tolist()) == ([1.0, 0.0, 0.0], [1.0, 1.0, 0.0])


def test_no_interval_of_anything_for_fewer_than_three_seeds() -> None:
    rng = np.random.default_rng(0)
    two, three = [0.0, 1.0], [0.0, 1.0, 2.0]
    ends = [
        *stats.mean_interval(two, rng),
        *stats.mean_difference_interval(three, two, rng),
        *stats.probability_of_improvement_interval([(three, three), (two, three)], rng),
        *np.ravel(stats.performance_profile_interval([two, three], [0.5], rng)),
        *stats.bootstrap([two], lambda x: x.mean(axis=1), rng),
        *stats.bootstrap([], lambda: np.zeros(1), rng),
    ]
    assert np.isnan(ends).all()


def test_nothing_is_said_where_a_method_has_no_score() -> None:
    assert math.isnan(stats.probability_of_improvement([([1.0], [])]))
    assert math.isnan(stats.probability_of_improvement([]))
    assert np.isnan(stats.performance_profile([[1.0], []], [0.0, 1.0])).all()


# What rliable says of the same scores (how they were made: tests/data/measure_rliable.py) -----------------------------

RLIABLE = json.loads((Path(__file__).parents[1] / "data" / "rliable.json").read_text())
FIRST, SECOND = np.array(RLIABLE["first"]).T, np.array(RLIABLE["second"]).T
"""Scores of two methods, (tasks, runs)."""
DRAWN = 0.02
"""Most that an end of an interval may differ by the luck of the draw; scores and shares come in steps."""


def test_numbers_are_those_of_rliable() -> None:
    assert stats.mean(FIRST) == pytest.approx(RLIABLE["mean"])
    assert stats.interquartile_mean(FIRST) == pytest.approx(RLIABLE["interquartile_mean"])
    improvement = stats.probability_of_improvement(list(zip(FIRST, SECOND, strict=True)))
    assert improvement == pytest.approx(RLIABLE["probability_of_improvement"])
    profile = stats.performance_profile(list(FIRST), RLIABLE["thresholds"])
    assert profile.tolist() == pytest.approx(RLIABLE["performance_profile"])


def test_intervals_are_those_of_rliable() -> None:
    rng = np.random.default_rng(0)
    pairs = list(zip(FIRST, SECOND, strict=True))
    improvement = stats.probability_of_improvement_interval(pairs, rng, resamples=20_000)
    assert improvement == pytest.approx(RLIABLE["probability_of_improvement_interval"], abs=DRAWN)
    across_tasks = stats.bootstrap(
        list(FIRST), lambda *runs: trim_mean(np.concatenate(runs, axis=1), 0.25, axis=1), rng, resamples=20_000
    )
    assert across_tasks == pytest.approx(RLIABLE["interquartile_mean_interval"], abs=DRAWN)
    low, high = stats.performance_profile_interval(list(FIRST), RLIABLE["thresholds"], rng)
    assert low.tolist() == pytest.approx(RLIABLE["performance_profile_interval"][0])
    assert high.tolist() == pytest.approx(RLIABLE["performance_profile_interval"][1])


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
