"""Polynomials meet what tasks compute, and say so where they do not."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.explorer.designers import first_look
from codesign_bench.explorer.functions import fit
from codesign_bench.explorer.goals import Goals
from codesign_bench.task import Floats, load_task


@pytest.mark.parametrize("name", ["push", "catch_balls", "scoop"])
def test_observations_before_the_design_are_met_to_single_precision(name: str) -> None:
    goals = Goals.of(load_task(name))
    function = fit(lambda points: first_look(goals, points).astype(np.float64), goals)
    assert function.error < 1e-6
    points = goals.random_points(np.random.default_rng(3), 30)
    np.testing.assert_allclose(function(points), first_look(goals, points), atol=1e-5)


def test_constants_are_exact_in_single_precision() -> None:
    goals = Goals.of(load_task("push"))
    value = np.float32(0.1)
    function = fit(lambda points: np.full((len(points), 1), float(value)), goals)
    assert (function(goals.random_points(np.random.default_rng(0), 9)).astype(np.float32) == value).all()


def test_the_error_tells_of_a_jump() -> None:
    goals = Goals.of(load_task("push"))

    def jump(points: Floats) -> Floats:
        return (points[:, :1] > goals.axes[0].low + 1.0).astype(np.float64)

    assert fit(jump, goals).error > 0.1


def test_features_that_jump_can_be_left_out() -> None:
    goals = Goals.of(load_task("push"))

    def both(points: Floats) -> Floats:
        return np.stack([points[:, 0], points[:, 0] > goals.axes[0].low + 1.0], axis=1).astype(np.float64)

    function = fit(both, goals)
    assert function.errors[0] < 1e-6 < 0.1 < function.errors[1]
    smooth = function.part([0])
    assert len(smooth.exponents) == 2, "a constant and a slope"
    points = goals.random_points(np.random.default_rng(0), 9)
    np.testing.assert_allclose(smooth(points), points[:, :1], atol=1e-5)
