"""Normalised scores, by numbers that can be checked by hand."""

from __future__ import annotations

import math

import pytest

from codesign_bench.stats import Reference, normalized_score


def test_idling_scores_0_and_the_best_known_scores_1() -> None:
    assert normalized_score([-2.0, 0.0, 6.0], Reference(-2.0, 6.0)) == pytest.approx([0.0, 0.25, 1.0])
    assert normalized_score(2.0, Reference(-2.0, 6.0)) == pytest.approx(0.5)


def test_scores_are_not_clipped() -> None:
    assert normalized_score([-4.0, 8.0], Reference(-2.0, 6.0)) == pytest.approx([-0.25, 1.25])


@pytest.mark.parametrize("reference", [None, Reference(1.0, 1.0), Reference(2.0, 1.0), Reference(math.nan, 1.0)])
def test_without_a_scale_there_is_no_score(reference: Reference | None) -> None:
    assert math.isnan(normalized_score(1.0, reference))
    assert [math.isnan(score) for score in normalized_score([1.0, 2.0], reference)] == [True, True]
