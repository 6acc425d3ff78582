"""Shares of few outcomes, against intervals that follow from the binomial distribution by hand."""

from __future__ import annotations

import pytest
from scipy.stats import binom

from codesign_bench.stats.proportions import proportion_interval, proportion_test

pytestmark = pytest.mark.numeric


@pytest.mark.parametrize("trials", [3, 5, 10])
def test_no_success_or_nothing_but_successes_by_hand(trials: int) -> None:
    # With probability p, no success has probability (1 - p)^n: at 2.5 % that gives the upper end.
    end = 1.0 - 0.025 ** (1.0 / trials)
    assert proportion_interval(0, trials) == pytest.approx((0.0, end))
    assert proportion_interval(trials, trials) == pytest.approx((1.0 - end, 1.0))


def test_three_outcomes_of_one_kind_decide_nothing_about_a_half() -> None:
    assert proportion_interval(0, 3)[1] > 0.5
    assert proportion_interval(3, 3)[0] < 0.5


def test_a_share_against_a_half_by_hand() -> None:
    # Six of six heads, and their opposite: 2 / 2^6.
    found = proportion_test(6, 6)
    assert (found.value, found.low, found.p) == (1.0, pytest.approx(0.025 ** (1.0 / 6.0)), pytest.approx(2 / 64))
    assert proportion_test(0, 3).p == pytest.approx(2 / 8)
    assert proportion_test(2, 4).p == 1.0


@pytest.mark.parametrize("null", [0.25, 0.5])
def test_the_interval_leaves_out_what_the_test_rejects(null: float) -> None:
    for successes in range(13):
        found = proportion_test(successes, 12, null)
        assert (found.p < 0.05) == (not found.low <= null <= found.high)


def test_wilsons_interval_by_hand() -> None:
    z = 1.959964  # the normal distribution's 97.5 % quantile
    centre, half = (0.5 + z**2 / 20.0) / (1.0 + z**2 / 10.0), z / (1.0 + z**2 / 10.0) * (0.025 + z**2 / 400.0) ** 0.5
    assert proportion_interval(5, 10, kind="wilson") == pytest.approx((centre - half, centre + half), rel=1e-5)


@pytest.mark.parametrize(("successes", "trials"), [(1, 0), (4, 3), (-1, 3)])
def test_impossible_counts_are_refused(successes: int, trials: int) -> None:
    with pytest.raises(ValueError, match=f"{successes} successes of {trials} trials"):
        proportion_interval(successes, trials)


@pytest.mark.parametrize("trials", [3, 6, 10])
@pytest.mark.parametrize("truth", [0.05, 0.3, 0.5, 0.9])
def test_the_exact_interval_covers_at_least_what_it_says(trials: int, truth: float) -> None:
    intervals = [proportion_interval(successes, trials) for successes in range(trials + 1)]
    held = [binom.pmf(k, trials, truth) for k, (low, high) in enumerate(intervals) if low <= truth <= high]
    assert sum(held) >= 0.95
