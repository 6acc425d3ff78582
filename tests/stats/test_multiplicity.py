"""Holm's adjustment by hand."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.stats.multiplicity import holm


def test_three_tests_by_hand() -> None:
    # In order: 0.01 x 3, 0.03 x 2, and 0.04 x 1, which may not fall below the one before.
    np.testing.assert_allclose(holm([0.01, 0.04, 0.03]), [0.03, 0.06, 0.06])


def test_nothing_exceeds_one_and_a_single_test_stays() -> None:
    np.testing.assert_allclose(holm([0.6, 0.7]), [1.0, 1.0])
    np.testing.assert_allclose(holm([0.2]), [0.2])


def test_tests_that_were_not_done_do_not_count() -> None:
    np.testing.assert_allclose(holm([0.01, np.nan, 0.04]), [0.02, np.nan, 0.04])
    assert holm([]).size == 0


def test_a_family_without_effects_errs_as_rarely_as_a_single_test() -> None:
    rng = np.random.default_rng(0)
    wrong = sum((holm(rng.uniform(size=24)) < 0.05).any() for _ in range(2_000))
    assert wrong < 2_000 * 0.05 + 4 * 10  # a standard deviation is 9.7
    assert wrong == pytest.approx(100, abs=40)
