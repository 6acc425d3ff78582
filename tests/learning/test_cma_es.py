"""CMA-ES: it optimises, it replays exactly, and its options reach pycma. Shapes: `P` candidates, `X` parameters."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from codesign_bench.learning.cma_es import Evolution, EvolutionConfig, reliability
from codesign_bench.task import Floats

pytestmark = pytest.mark.numeric

CONFIG = EvolutionConfig(popsize=8, sigma0=0.3)
OPTIMUM = np.array([0.3, -0.5, 0.1, 0.0, 0.7])


def make(config: EvolutionConfig = CONFIG, size: int = 5, seed: int = 0) -> Evolution:
    """Return an evolution at its start."""
    return Evolution(size, config, np.random.default_rng(seed))


def sphere(candidates: Floats) -> Floats:
    """Return the fitness (P,) of candidates (P, X): minus the squared distance from the optimum."""
    return -((candidates - OPTIMUM[: candidates.shape[1]]) ** 2).sum(axis=1)


def run(evolution: Evolution, generations: int) -> Evolution:
    """Take some generations on the sphere."""
    for _ in range(generations):
        evolution.tell(sphere(evolution.ask()))
    return evolution


def test_it_finds_the_optimum_of_a_sphere() -> None:
    evolution = run(make(), 60)
    np.testing.assert_allclose(evolution.mean, OPTIMUM, atol=0.02)
    assert evolution.sigma < CONFIG.sigma0


def test_larger_is_better_and_candidates_stay_in_the_box() -> None:
    evolution = make(replace(CONFIG, sigma0=1.0), size=2)
    for _ in range(30):
        candidates = evolution.ask()
        assert candidates.shape == (CONFIG.popsize, 2)
        assert np.abs(candidates).max() <= 1.0
        evolution.tell(candidates.sum(axis=1))
    assert evolution.mean.min() > 0.9


def test_a_single_parameter_is_searched_too() -> None:
    evolution = run(make(size=1), 40)
    assert evolution.ask().shape == (CONFIG.popsize, 1)
    np.testing.assert_allclose(evolution.mean, OPTIMUM[:1], atol=0.02)


def test_it_begins_at_the_start_or_at_the_centre() -> None:
    narrow, corner = replace(CONFIG, sigma0=1e-6), np.array([0.9, -1.0, 0.0, 1.0, -0.2])
    begun = Evolution(5, narrow, np.random.default_rng(0), corner).ask()
    np.testing.assert_allclose(begun, np.tile(corner, (CONFIG.popsize, 1)), atol=1e-4)
    np.testing.assert_allclose(make(narrow).ask(), 0.0, atol=1e-4)


def test_asking_again_before_telling_gives_the_same() -> None:
    evolution = make()
    first = evolution.ask()
    first_again = evolution.ask()
    np.testing.assert_array_equal(first, first_again)
    evolution.tell(sphere(first))
    assert not np.array_equal(evolution.ask(), first)


def test_a_replay_gives_the_same_mean_and_next_generation() -> None:
    original = run(make(), 7)
    again = make()
    again.replay(np.array(original.history))
    np.testing.assert_array_equal(again.mean, original.mean)
    np.testing.assert_array_equal(again.ask(), original.ask())
    assert (again.sigma, again.history) == (original.sigma, original.history)
    np.testing.assert_array_equal(run(again, 3).ask(), run(original, 3).ask())


def test_seeds_and_global_generators() -> None:
    np.random.seed(1)  # noqa: NPY002  # The point: pycma's usual source of randomness has no say.
    first = run(make(), 2).ask()
    np.random.seed(2)  # noqa: NPY002
    state = np.random.get_state()  # noqa: NPY002
    second = run(make(), 2).ask()
    assert np.array_equal(state[1], np.random.get_state()[1])  # noqa: NPY002
    np.testing.assert_array_equal(first, second)
    assert not np.array_equal(run(make(seed=1), 2).ask(), first)


def test_others_do_not_shift_its_numbers() -> None:
    rng = np.random.default_rng(0)
    evolution = Evolution(5, CONFIG, rng)
    rng.standard_normal(100)
    np.testing.assert_array_equal(evolution.ask(), make().ask())


@pytest.mark.parametrize(
    ("field", "option"),
    [
        ("center_learning_rate", "CMA_cmean"),
        ("covariance_learning_rate", "CMA_on"),
        ("rank_mu_learning_rate", "CMA_rankmu"),
        ("rank_one_learning_rate", "CMA_rankone"),
    ],
)
def test_options_reach_pycma_and_matter(field: str, option: str) -> None:
    changed = make(replace(CONFIG, **{field: 0.25}))
    strategy: Any = changed._strategy
    assert strategy.opts[option] == 0.25
    assert not np.array_equal(run(changed, 5).ask(), run(make(), 5).ask())


def test_population_and_first_spread_reach_pycma() -> None:
    evolution = make(EvolutionConfig(popsize=500, sigma0=0.02))
    assert evolution.ask().shape == (500, 5)
    assert evolution.ask().std() == pytest.approx(0.02, rel=0.1)


def test_reliability_by_hand() -> None:
    # Candidates differ by 1 on every instance, instances by 10: nothing is noise.
    assert reliability(np.array([[0.0, 10.0], [1.0, 11.0], [2.0, 12.0]])) == 1.0
    # Candidates' means 0 and 1, variance 1/2; residuals of 1/2 each. So 2 * 1/2 between, (4 * 1/4) / 1 within.
    assert reliability(np.array([[-0.5, 0.5], [1.5, 0.5]])) == 0.0
    # As above with residuals of 1/4: 1 - (4 / 16) / 1.
    assert reliability(np.array([[-0.25, 0.25], [1.25, 0.75]])) == pytest.approx(0.75)


def test_nothing_is_said_of_reliability_without_a_second_instance_or_a_difference() -> None:
    assert np.isnan(reliability(np.zeros((3, 1))))
    assert np.isnan(reliability(np.zeros((1, 3))))
    assert np.isnan(reliability(np.array([[0.0, 1.0], [1.0, 0.0]])))


def test_a_search_that_has_found_its_optimum_says_so() -> None:
    evolution = Evolution(2, EvolutionConfig(popsize=8, sigma0=0.3), np.random.default_rng(0))
    assert evolution.metrics() == {"generations": 0.0, "sigma": 0.3, "sigma_fraction": 1.0, "converged": 0.0}
    for _ in range(400):
        evolution.tell(-(evolution.ask() ** 2).sum(axis=1))
        if evolution.converged:
            break
    assert evolution.converged
    assert evolution.metrics()["sigma_fraction"] < 1e-3
