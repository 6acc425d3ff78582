"""Tests that reshuffle labels, by counting the ways by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from codesign_bench.stats import permutation
from codesign_bench.stats.permutation import difference_p, jonckheere_p, sign_flip_p, stratified_p

pytestmark = pytest.mark.numeric


@pytest.fixture
def rng() -> np.random.Generator:
    """Draws permutations where there are too many."""
    return np.random.default_rng(0)


def test_complete_separation_of_three_and_three_is_one_way_of_twenty_on_either_side(rng: np.random.Generator) -> None:
    assert difference_p([4.0, 5.0, 6.0], [1.0, 2.0, 3.0], rng) == pytest.approx(2 / 20)
    assert difference_p([1.0, 2.0, 3.0], [4.0, 5.0, 6.0], rng) == pytest.approx(2 / 20)


def test_six_of_a_kind_say_nothing(rng: np.random.Generator) -> None:
    assert difference_p([1.0] * 3, [1.0] * 3, rng) == 1.0
    assert math.isnan(difference_p([], [1.0], rng))


def test_two_tasks_multiply_their_ways(rng: np.random.Generator) -> None:
    pair = ([3.0, 4.0], [1.0, 2.0])  # one way of six on either side
    assert difference_p(*pair, rng) == pytest.approx(2 / 6)
    assert stratified_p([pair, pair], rng) == pytest.approx(2 / 36)
    # Tasks that point in opposite directions cancel each other.
    assert stratified_p([pair, pair[::-1]], rng) == 1.0


def test_a_tasks_scale_has_no_say(rng: np.random.Generator) -> None:
    small, large = ([0.3, 0.4], [0.1, 0.2]), ([1.0, 2.0], [3.0, 4.0])
    assert stratified_p([small, large], rng) == 1.0


def test_what_is_drawn_is_close_to_what_is_counted(monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator) -> None:
    first, second = rng.normal(0.8, 1.0, 6), rng.normal(0.0, 1.0, 6)
    counted = difference_p(first, second, rng)  # 924 ways
    monkeypatch.setattr(permutation, "MOST", 900)
    drawn = difference_p(first, second, rng)
    # The share of 900 draws has a standard deviation of at most sqrt(p (1 - p) / 900).
    assert drawn == pytest.approx(counted, abs=4.0 * math.sqrt(counted * (1.0 - counted) / 900.0))


def test_signs_of_three_differences_have_eight_ways(rng: np.random.Generator) -> None:
    assert sign_flip_p([1.0, 2.0, 3.0], rng) == pytest.approx(2 / 8)
    assert sign_flip_p([1.0, -1.0], rng) == 1.0
    assert math.isnan(sign_flip_p([], rng))


def test_a_trend_by_hand(rng: np.random.Generator) -> None:
    # Of 12 pairs of different levels all rise: 90 ways of dealing six scores to three levels, one rises and one falls.
    direction, p = jonckheere_p([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]], rng)
    assert direction == 1.0
    assert p == pytest.approx(2 / 90, abs=4.0 * math.sqrt(2 / 90 / permutation.MOST))
    assert jonckheere_p([[5.0, 6.0], [3.0, 4.0], [1.0, 2.0]], rng)[0] == -1.0
    # Pairs: 1 rises against 2 and ties 1: (1 - 0) / 2 and so on.
    assert jonckheere_p([[1.0], [1.0, 2.0]], rng)[0] == pytest.approx(0.5)


def test_scores_within_the_tolerance_are_equal(rng: np.random.Generator) -> None:
    assert jonckheere_p([[0.1], [0.2], [0.3]], rng)[0] == 1.0
    assert jonckheere_p([[0.1], [0.2], [0.3]], rng, same=0.5) == (0.0, 1.0)
    # Of three pairs, 0.1 and 0.9 alone are far enough apart, as are 0.2 and 0.9.
    assert jonckheere_p([[0.1], [0.2], [0.9]], rng, same=0.5)[0] == pytest.approx(2 / 3)


def test_a_trend_needs_two_levels_with_scores(rng: np.random.Generator) -> None:
    assert all(math.isnan(value) for value in jonckheere_p([[1.0]], rng))
    assert all(math.isnan(value) for value in jonckheere_p([[1.0], []], rng))


@pytest.mark.parametrize("seeds", [3, pytest.param(6, marks=pytest.mark.slow)])
def test_without_an_effect_few_tests_find_one(seeds: int) -> None:
    rng, trials = np.random.default_rng(seeds), 400
    found = {"difference": 0, "trend": 0, "tasks": 0}
    for _ in range(trials):
        samples = rng.binomial(1, 0.7, size=(3, seeds)) + 0.05 * rng.normal(size=(3, seeds))  # seeds that fail or not
        found["difference"] += difference_p(samples[0], samples[1], rng) < 0.05
        found["tasks"] += stratified_p([(samples[0], samples[1]), (samples[1], samples[2])], rng) < 0.05
        found["trend"] += jonckheere_p(samples, rng)[1] < 0.05
    # 5 % of 400 with a standard deviation of 4.4.
    assert max(found["difference"], found["trend"]) < 20 + 4 * 4.4
