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
IN_ORDER = tradeoff.ratio_in_order(TASK, OURS, ALPHAS, "")


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
    ("values", "verdict", "correlation"),
    [
        ((HIGH, MIDDLE, LOW), SUPPORTED, -1.0),
        ((LOW, MIDDLE, HIGH), CONTRADICTED, 1.0),
        ((MIDDLE, MIDDLE, MIDDLE), UNDECIDED, 0.0),
    ],
)
def test_the_ratio_falls_as_alpha_rises(values: Sequence[Sequence[float]], verdict: str, correlation: float) -> None:
    finding = found(RATIO_FALLS, traded(dict(zip(ALPHAS, values, strict=True))))
    assert (finding.verdict, finding.value) == (verdict, pytest.approx(correlation))


def test_rising_and_falling_are_opposite_verdicts() -> None:
    evidence = traded(dict(zip(ALPHAS, (LOW, MIDDLE, HIGH), strict=True)))
    rises = tradeoff.rises_with_alpha(TASK, OURS, ALPHAS, tradeoff.MATERIAL, "")
    falls = tradeoff.falls_with_alpha(TASK, OURS, ALPHAS, tradeoff.MATERIAL, "")
    assert (found(rises, evidence).verdict, found(falls, evidence).verdict) == (SUPPORTED, CONTRADICTED)
    assert found(EFFORT_RISES, evidence).verdict == UNDECIDED, "all make the same effort"


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


def test_a_seed_that_never_moves_has_no_ratio() -> None:
    still = traded(dict(zip(ALPHAS, (HIGH, MIDDLE, LOW), strict=True)), effort=0.0)
    for rule in (RATIO_FALLS, IN_ORDER):
        with pytest.raises(InsufficientData, match="never moves"):
            found(rule, still)
