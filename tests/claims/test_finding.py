"""A verdict follows from an interval, a threshold, the least effect and the other claims of its family."""

from __future__ import annotations

import math

from codesign_bench.claims.finding import (
    CONTRADICTED,
    SUPPORTED,
    UNDECIDED,
    Finding,
    above,
    below,
    joined,
    probability,
    reason,
)
from codesign_bench.stats import Estimate


def test_a_verdict_needs_the_whole_interval_on_one_side() -> None:
    over, under, around = (Estimate(0.15, 0.1, 0.2), Estimate(-0.15, -0.2, -0.1), Estimate(0.0, -0.1, 0.1))
    assert [above(found) for found in (over, under, around)] == [SUPPORTED, CONTRADICTED, UNDECIDED]
    assert [below(found) for found in (over, under, around)] == [CONTRADICTED, SUPPORTED, UNDECIDED]


def test_an_interval_that_touches_the_threshold_or_is_missing_decides_nothing() -> None:
    for found in (Estimate(0.5, 0.0, 1.0), Estimate(0.5)):
        assert above(found) == below(found) == UNDECIDED


def test_an_effect_must_be_as_large_as_the_least_that_counts() -> None:
    small = Estimate(0.15, 0.1, 0.2)
    assert [above(small, least=least) for least in (0.15, 0.16)] == [SUPPORTED, UNDECIDED]
    assert [below(small, 0.3, least=least) for least in (0.15, 0.16)] == [SUPPORTED, UNDECIDED]


def test_the_reason_is_told_where_the_interval_does_not_show_it() -> None:
    small = Estimate(0.15, 0.1, 0.2)
    assert reason(small, least=0.16) == "smaller than the least effect of 0.16"
    assert reason(small, least=0.15) == ""
    assert reason(Estimate(0.0, -0.1, 0.1), least=0.16) == ""
    assert reason(Estimate(1.0)) == "seeds do not differ, so nothing is known of their spread"


def test_a_family_may_take_a_verdict_back() -> None:
    alone = Finding(SUPPORTED, 1.0, 0.5, 1.5, note="so be it", p=0.03)
    kept, lost = alone.adjusted(0.03, 1), alone.adjusted(0.06, 2)
    assert (kept.verdict, kept.p_adjusted, kept.family_size, kept.note) == (SUPPORTED, 0.03, 1, "so be it")
    assert (lost.verdict, lost.p_adjusted, lost.family_size) == (UNDECIDED, 0.06, 2)
    assert lost.note == "so be it; p is 0.060 after adjustment for 2 claims"
    assert Finding(UNDECIDED, 1.0, p=0.5).adjusted(1.0, 2).note == ""
    twice = alone.adjusted(0.06, 3, looks=2)
    assert twice.note == "so be it; p is 0.060 after adjustment for 3 claims, each judged up to 2 times"
    assert Finding(CONTRADICTED, -1.0, p=0.05).adjusted(0.05, 1).verdict == UNDECIDED, "0.05 is not below 0.05"


def test_p_values_and_notes_are_told_in_few_characters() -> None:
    told = [probability(p) for p in (0.04962, 0.001, 0.0009, 1.0, math.nan)]
    assert told == ["0.050", "0.001", "<0.001", "1.000", ""]
    assert joined("", "one", "", "two") == "one; two"
