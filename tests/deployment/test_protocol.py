"""The trials that are planned are the paper's."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench import load_task
from codesign_bench.deployment.protocol import grid_trials, own_trials
from codesign_bench.task import deployment_of


def test_the_papers_real_starts_are_turned_by_half_a_turn_into_our_frame() -> None:
    trials = deployment_of(load_task("fetch_cube")).trials
    assert trials.own.tolist() == [[0.110, 0.803], [0.339, 0.588], [-0.155, 0.731], [-0.211, 0.633]]
    assert len(trials.own) == len(deployment_of(load_task("lift_cup")).trials.own) == 4


def test_the_grid_is_the_papers_with_the_farthest_row_first() -> None:
    grid = deployment_of(load_task("fetch_cube")).trials.grid
    assert grid.shape == (3, 4, 2)
    assert np.diff(grid[:, 0, 1]) == pytest.approx([-0.06, -0.06])
    assert np.diff(grid[0, :, 0]) == pytest.approx([0.28533] * 3, abs=1e-5)
    assert grid.mean(axis=(0, 1)) == pytest.approx([0.0, 0.65])


def test_the_protocol_has_five_trials_of_each_tool_and_twelve_starts() -> None:
    trials = deployment_of(load_task("fetch_cube")).trials
    assert len(list(own_trials(trials, (1, 2, 3, 4), trials.trials_per_tool))) == 20
    planned = list(grid_trials(trials, (1, 2, 3, 4)))
    assert len({trial.name for trial in planned}) == 48
    assert list(grid_trials(deployment_of(load_task("lift_cup")).trials, (1, 2))) == []
