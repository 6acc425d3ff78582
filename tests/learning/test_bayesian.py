"""Bayesian optimisation finds the best point of a noisy function in a dozen evaluations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from codesign_bench.learning.bayesian import expected_improvement, first_points, fitted, next_point, predicted

BEST = np.array([0.4, -0.3])


def test_the_first_points_are_a_latin_hypercube() -> None:
    points = first_points(5, 3, np.random.default_rng(0))
    assert points.shape == (5, 3)
    # Each fifth of every parameter's range has one point.
    fifths = np.floor((points + 1.0) / 2.0 * 5.0)
    assert [sorted(column) for column in fifths.T.tolist()] == [[0, 1, 2, 3, 4]] * 3
    assert points.tolist() == first_points(5, 3, np.random.default_rng(0)).tolist()


def test_expected_improvement_at_the_mark_is_that_of_half_a_normal_distribution() -> None:
    gain = expected_improvement(np.array([1.0, 3.0, 0.0]), np.array([2.0, 1e-9, 1e-9]), mark=1.0)
    # At the mark: std * phi(0). Certain values gain what they are above the mark, or nothing.
    assert gain == pytest.approx([2.0 * norm.pdf(0.0), 2.0, 0.0])


def test_a_certain_value_gains_what_it_is_above_the_mark() -> None:
    assert expected_improvement(np.array([1.5, 0.5]), np.zeros(2), mark=1.0).tolist() == [0.5, 0.0]


def test_expected_improvement_is_the_mean_of_what_draws_exceed_the_mark_by() -> None:
    draws = np.random.default_rng(0).normal(0.3, 0.7, 200_000)
    known = expected_improvement(np.array([0.3]), np.array([0.7]), mark=0.5)[0]
    assert known == pytest.approx((draws - 0.5).clip(0.0).mean(), abs=0.005)


def test_noise_is_not_taken_for_ignorance() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(-1.0, 1.0, (60, 1))
    values = np.sign(np.sin(4.0 * points[:, 0])) + 0.5 * rng.standard_normal(60)
    process = fitted(points, (values - values.mean()) / values.std())
    with_noise = process.predict(points, return_std=True)[1]
    _, without = predicted(process, points)
    assert (without < 0.8 * with_noise).all()


def test_the_best_point_is_found_in_a_dozen_noisy_evaluations_better_than_by_chance() -> None:
    def value(points: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        return -((points - BEST) ** 2).sum(axis=-1) + 0.02 * rng.standard_normal(len(points))

    gaps, by_chance = [], []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        points = first_points(4, 2, rng)
        values = value(points, rng)
        for _ in range(8):
            chosen = next_point(points, values, rng)
            assert (np.abs(chosen) <= 1.0).all()
            points, values = np.vstack([points, chosen]), np.append(values, value(chosen[None], rng))
        gaps.append(np.linalg.norm(points[values.argmax()] - BEST))
        by_chance.append(np.linalg.norm(rng.uniform(-1.0, 1.0, (12, 2)) - BEST, axis=1).min())
    assert np.mean(gaps) < 0.5 * np.mean(by_chance)


@pytest.mark.parametrize("values", [[0.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0]])
def test_two_points_or_equal_values_are_enough(values: list[float]) -> None:
    points = first_points(len(values), 4, np.random.default_rng(1))
    first, again = (next_point(points, np.array(values), np.random.default_rng(2)) for _ in range(2))
    assert np.isfinite(first).all()
    assert first.tolist() == again.tolist()
