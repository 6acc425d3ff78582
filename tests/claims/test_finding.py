"""A verdict follows from an interval and a threshold."""

from __future__ import annotations

import math

from codesign_bench.claims.finding import CONTRADICTED, SUPPORTED, UNDECIDED, above, below


def test_a_verdict_needs_the_whole_interval_on_one_side() -> None:
    assert [above(0.1, 0.2, 0.0), above(-0.2, -0.1, 0.0), above(-0.1, 0.1, 0.0)] == [SUPPORTED, CONTRADICTED, UNDECIDED]
    assert [below(0.1, 0.2, 0.0), below(-0.2, -0.1, 0.0), below(-0.1, 0.1, 0.0)] == [CONTRADICTED, SUPPORTED, UNDECIDED]


def test_an_interval_that_touches_the_threshold_or_is_missing_decides_nothing() -> None:
    assert above(0.0, 1.0, 0.0) == below(0.0, 1.0, 0.0) == UNDECIDED
    assert above(math.nan, math.nan, 0.0) == below(math.nan, math.nan, 0.0) == UNDECIDED
    assert below(math.inf, math.inf, 1.0) == CONTRADICTED
