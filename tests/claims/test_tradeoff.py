"""Rules about trading material against effort, by numbers that can be checked by hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
import pytest

from codesign_bench.claims import tradeoff
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import CONTRADICTED, SUPPORTED, UNDECIDED, InsufficientData
from evidence import OURS, TASK, cells, found

ALPHAS = (0.0, 0.3, 0.7)
RATIO_FALLS = tradeoff.falls_with_alpha(TASK, OURS, ALPHAS, tradeoff.RATIO, "")
EFFORT_RISES = tradeoff.rises_with_alpha(TASK, OURS, ALPHAS, tradeoff.EFFORT, "")
MATERIAL_RISES = tradeoff.rises_with_alpha(TASK, OURS, ALPHAS, tradeoff.MATERIAL, "")
MATERIAL_FALLS = tradeoff.falls_with_alpha(TASK, OURS, ALPHAS, tradeoff.MATERIAL, "")
IN_ORDER = tradeoff.ratio_drops_each_time(TASK, OURS, ALPHAS, "")


def traded(material: Mapping[float, Sequence[float]], effort: float = 0.5) -> Evidence:
    """Return seeds that use this material on two instances each, on average, and `effort`."""
    parts = []
    for alpha, values in material.items():
        columns = {
            "seed": np.repeat(np.arange(len(values)), 2),
            "return": np.zeros(2 * len(values)),
            "material": np.ravel([(value - 0.05, value + 0.05) for value in values]),
            "effort": np.full(2 * len(values), effort),
        }
        parts.append(cells(OURS, f"alpha-{alpha:.2f}", **columns))
    return Evidence(evaluations=pd.concat(parts))


HIGH, MIDDLE, LOW = (0.8, 0.85, 0.9), (0.5, 0.55, 0.6), (0.2, 0.25, 0.3)


@pytest.mark.parametrize(
    ("values", "verdict", "trend"),
    [
        ((HIGH, MIDDLE, LOW), SUPPORTED, -1.0),
        ((LOW, MIDDLE, HIGH), CONTRADICTED, 1.0),
        ((MIDDLE, MIDDLE, MIDDLE), UNDECIDED, 0.0),
    ],
)
def test_the_ratio_falls_as_alpha_rises(values: Sequence[Sequence[float]], verdict: str, trend: float) -> None:
    finding = found(RATIO_FALLS, traded(dict(zip(ALPHAS, values, strict=True))))
    assert (finding.verdict, finding.value) == (verdict, pytest.approx(trend))


def test_rising_and_falling_are_opposite_verdicts() -> None:
    evidence = traded(dict(zip(ALPHAS, (LOW, MIDDLE, HIGH), strict=True)))
    assert (found(MATERIAL_RISES, evidence).verdict, found(MATERIAL_FALLS, evidence).verdict) == (
        SUPPORTED,
        CONTRADICTED,
    )
    assert found(EFFORT_RISES, evidence).verdict == UNDECIDED, "all make the same effort"


def test_p_is_the_share_of_ways_to_deal_out_the_seeds() -> None:
    finding = found(RATIO_FALLS, traded(dict(zip(ALPHAS, (HIGH, MIDDLE, LOW), strict=True))))
    # 9! / (3!)^3 = 1680 ways; this one and its opposite are the most extreme.
    assert finding.p == pytest.approx(2 / 1680, abs=4.0 * np.sqrt(2 / 1680 / 20_000))
    assert finding.note == "means 1.70, 1.10, 0.50"


def test_a_trend_in_the_last_digit_is_none() -> None:
    fine = [tuple(0.5 + 1e-5 * (3 * level + seed) for seed in range(3)) for level in range(3)]
    finding = found(MATERIAL_RISES, traded(dict(zip(ALPHAS, fine, strict=True))))
    assert (finding.verdict, finding.value, finding.p) == (UNDECIDED, 0.0, 1.0)


def test_one_seed_makes_no_trend() -> None:
    values = ((0.59, 0.58, 0.9), (0.58, 0.58, 0.58), (0.58, 0.58, 0.58))
    finding = found(MATERIAL_FALLS, traded(dict(zip(ALPHAS, values, strict=True))))
    assert finding.verdict == UNDECIDED
    assert finding.value < 0.0


@pytest.mark.parametrize(
    ("values", "verdict", "drop"),
    [
        ((HIGH, MIDDLE, LOW), SUPPORTED, 0.6),
        ((HIGH, LOW, MIDDLE), CONTRADICTED, -0.6),
        ((HIGH, MIDDLE, (0.4, 0.5, 0.6)), UNDECIDED, 0.1),
    ],
)
def test_in_order_asks_every_step_to_go_down(values: Sequence[Sequence[float]], verdict: str, drop: float) -> None:
    # Ratios are twice the material, whose means are 0.85, 0.55, 0.25 and, in the last case, 0.5.
    finding = found(IN_ORDER, traded(dict(zip(ALPHAS, values, strict=True))))
    assert (finding.verdict, finding.value) == (verdict, pytest.approx(drop))


def test_the_smallest_drop_has_the_interval_of_its_step() -> None:
    finding = found(IN_ORDER, traded(dict(zip(ALPHAS, (HIGH, MIDDLE, LOW), strict=True))))
    # Ratios have a standard deviation of 0.1: 0.6 -+ t 0.1 sqrt(2 / 3). Of two steps the upper end takes 98.75 %.
    error = 0.1 * np.sqrt(2.0 / 3.0)
    assert (finding.low, finding.high) == pytest.approx((0.6 - 2.776445 * error, 0.6 + 3.495406 * error), rel=1e-5)


def test_a_seed_that_never_moves_has_no_ratio() -> None:
    still = traded(dict(zip(ALPHAS, (HIGH, MIDDLE, LOW), strict=True)), effort=0.0)
    for rule in (RATIO_FALLS, IN_ORDER):
        with pytest.raises(InsufficientData, match="never moves"):
            found(rule, still)
