"""Curves on a common grid, and what is said of them at each step, by hand."""

from __future__ import annotations

import math

import pandas as pd
import pytest

from codesign_bench import stats

pytestmark = pytest.mark.numeric


def curve(
    seed: int, steps: list[int], values: list[float], *, method: str = "gnn_ppo", variant: str = "default"
) -> pd.DataFrame:
    """Return one curve as `load_results` would give it."""
    columns = {"task": "push", "method": method, "variant": variant, "seed": seed}
    return pd.DataFrame({"env_steps": steps, "return_mean": values, **columns}, index=range(len(steps)))


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
