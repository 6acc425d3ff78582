"""Contextual CMA-ES finds the best parameters as a function of the context."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.learning.contextual_cma import ContextFeatures, Distribution, selection_weights
from codesign_bench.task import Box, Floats

STATE, GOAL = Box.of(place=(-2.0, 2.0, "m")), Box.of(x=(0.0, 4.0, "m"), y=(-1.0, 1.0, "m"))


def contexts(rng: np.random.Generator, count: int) -> Floats:
    """Return contexts (n, 3) inside of their ranges."""
    return rng.uniform([-2.0, 0.0, -1.0], [2.0, 4.0, 1.0], size=(count, 3))


def test_features_are_one_the_numbers_and_the_products_of_the_goal() -> None:
    of = ContextFeatures(STATE, GOAL)
    assert of.size == 1 + 3 + 3
    # Scaled to [-1, 1], the context is 0.5, -0.5, 1.
    np.testing.assert_allclose(of(np.array([[1.0, 1.0, 1.0]])), [[1.0, 0.5, -0.5, 1.0, 0.25, -0.5, 1.0]])


def test_samples_are_ranked_by_what_they_gain_over_others_in_their_context() -> None:
    features = np.array([[1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [1.0, 1.0]])
    # The second context pays 10 more. The better sample of each context has the same advantage, 0.5 over the usual.
    weight = selection_weights(features, np.array([0.0, 1.0, 11.0, 10.0]))
    logs = np.log(4.5) - np.log([1, 2, 3, 4])
    assert weight.sum() == pytest.approx(1.0)
    assert sorted(weight[[1, 2]], reverse=True) == pytest.approx(logs[:2] / logs.sum())
    assert sorted(weight[[0, 3]], reverse=True) == pytest.approx(logs[2:] / logs.sum())


def searched(rng: np.random.Generator, best: Floats, noise: float, generations: int) -> tuple[Distribution, Floats]:
    """Search for parameters `best` (f, D) times the features; return the distribution and its errors (n, D)."""
    of = ContextFeatures(STATE, GOAL)
    found = Distribution.start(of.size, best.shape[1], sigma0=0.4)
    for _ in range(generations):
        seen = contexts(rng, 60)
        features = of(seen)
        samples = found.mean(features) + rng.standard_normal((60, best.shape[1])) @ found.root().T
        gap = np.clip(samples, -1.0, 1.0) - features @ best
        # What a context pays differs by far more than what a design changes.
        found.update(features, samples, 5.0 * seen[:, 0] - (gap**2).sum(axis=1) + noise * rng.standard_normal(60))
    features = of(contexts(rng, 200))
    return found, found.mean(features) - features @ best


@pytest.mark.parametrize(("noise", "error"), [(0.0, 0.02), (0.1, 0.15)])
def test_it_finds_the_best_parameters_of_every_context(noise: float, error: float) -> None:
    rng = np.random.default_rng(0)
    best = np.zeros((7, 4))
    best[0], best[2], best[5] = (0.2, -0.3, 0.0, 0.1), (0.5, 0.0, -0.4, 0.0), (0.0, 0.2, 0.0, -0.3)
    found, gaps = searched(rng, best, noise, generations=150)
    assert np.abs(gaps).mean() < error
    assert found.sigma < 0.4


def test_a_mean_beyond_the_bounds_stays_at_them() -> None:
    best = np.zeros((7, 2))
    best[0] = (1.5, -1.5)
    found, _ = searched(np.random.default_rng(1), best, noise=0.0, generations=100)
    means = found.mean(ContextFeatures(STATE, GOAL)(contexts(np.random.default_rng(2), 50)))
    np.testing.assert_allclose(means, np.broadcast_to([1.0, -1.0], means.shape), atol=0.05)


def test_returns_without_information_leave_the_mean_about_where_it_is() -> None:
    rng, of = np.random.default_rng(3), ContextFeatures(STATE, GOAL)
    found = Distribution.start(of.size, 3, sigma0=0.1)
    for _ in range(30):
        features = of(contexts(rng, 60))
        samples = found.mean(features) + rng.standard_normal((60, 3)) @ found.root().T
        found.update(features, samples, rng.standard_normal(60))
    # A random walk of 30 steps of 0.1 / sqrt(60 / 7) each.
    assert np.abs(found.mean(of(contexts(rng, 100)))).mean() < 0.35
    assert 0.05 < found.sigma < 0.2


def test_one_sample_says_nothing() -> None:
    found = Distribution.start(7, 2, sigma0=0.1)
    found.update(np.ones((1, 7)), np.ones((1, 2)), np.ones(1))
    assert (found.generations, found.sigma) == (0, 0.1)
