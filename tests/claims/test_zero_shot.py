"""Rules about instances that were never trained on, by numbers that can be checked by hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
import pytest

from codesign_bench.claims import zero_shot
from codesign_bench.claims.claim import Rule
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import CONTRADICTED, SUPPORTED, UNDECIDED, InsufficientData
from evidence import OURS, TASK, cells, found

FRACTIONS = (0.1, 0.4, 0.9)
CLOSE = zero_shot.unseen_close(TASK, OURS, 0.1, "")
FALLS = zero_shot.unseen_falls(TASK, OURS, FRACTIONS, "")
GENTLY = zero_shot.unseen_falls_gently(TASK, OURS, FRACTIONS, "")
PORTION = zero_shot.unseen_solved(TASK, OURS, 0.9, "")


def cutouts(unseen: Mapping[float, Sequence[float]], seen: float = 10.0) -> Evidence:
    """Return seeds that get `seen` on one instance outside the cutout and `unseen[fraction][seed]` on one in it.

    An instance is solved if its return is at least 5.
    """
    parts = []
    for fraction, returns in unseen.items():
        flat = np.ravel([(seen, value) for value in returns])
        columns = {
            "seed": np.repeat(np.arange(len(returns)), 2),
            "in_cutout": [0.0, 1.0] * len(returns),
            "return": flat,
            "success": (flat >= 5.0).astype(int),
        }
        parts.append(cells(OURS, f"cutout-{fraction:.2f}", **columns))
    return Evidence(evaluations=pd.concat(parts))


@pytest.mark.parametrize(
    ("returns", "verdict", "share"),
    [
        ((9.5, 9.6, 9.7), SUPPORTED, 0.96),
        ((8.0, 8.5, 8.7), CONTRADICTED, 0.84),
        ((8.0, 9.5, 9.8), UNDECIDED, 0.91),
    ],
)
def test_unseen_instances_are_close_if_they_keep_nine_tenths(
    returns: Sequence[float], verdict: str, share: float
) -> None:
    finding = found(CLOSE, cutouts({0.1: returns}))
    assert (finding.verdict, finding.value) == (verdict, pytest.approx(share))


def test_a_policy_that_learned_nothing_is_nothing_to_compare_with() -> None:
    with pytest.raises(InsufficientData, match="no learned behaviour"):
        found(CLOSE, cutouts({0.1: (1.0, 1.0, 1.0)}, seen=-0.1))


def test_a_cutout_without_instances_is_lacking() -> None:
    evidence = cutouts({0.1: (1.0, 1.0, 1.0)})
    with pytest.raises(InsufficientData, match="no instances both in and outside"):
        found(CLOSE, Evidence(evaluations=evidence.evaluations.assign(in_cutout=0.0)))
    with pytest.raises(InsufficientData, match=r"cutout-0\.10"):
        found(CLOSE, Evidence(evaluations=evidence.evaluations.drop(columns="in_cutout")))


@pytest.mark.parametrize(
    ("middle", "last", "verdict", "correlation"),
    [
        ((7.0, 7.5, 8.0), (5.0, 5.5, 6.0), SUPPORTED, -1.0),
        ((9.5, 9.6, 9.7), (9.8, 9.8, 9.9), CONTRADICTED, 1.0),
        ((2.0, 9.0, 10.0), (8.0, 9.0, 9.4), UNDECIDED, -0.5),
    ],
)
def test_the_return_falls_with_the_cutout(
    middle: Sequence[float], last: Sequence[float], verdict: str, correlation: float
) -> None:
    # The first fraction has mean 9.1; the last case 7 and 8.8: ranks 3, 1, 2 have correlation -0.5 with 1, 2, 3.
    finding = found(FALLS, cutouts({0.1: (9.0, 9.1, 9.2), 0.4: middle, 0.9: last}))
    assert (finding.verdict, finding.value) == (verdict, pytest.approx(correlation))
    assert finding.n == "3 seeds at each of 0.1, 0.4, 0.9"


@pytest.mark.parametrize(
    ("last", "verdict", "loss"),
    [
        ((6.0, 6.5, 7.0), SUPPORTED, 0.2),
        ((1.0, 1.2, 1.4), CONTRADICTED, 0.73),
        ((0.0, 5.0, 8.0), UNDECIDED, 0.85 - 13.0 / 30.0),
    ],
)
def test_a_gentle_fall_loses_less_than_half_at_a_step(last: Sequence[float], verdict: str, loss: float) -> None:
    # Shares 0.9, then 0.85, then the last one's mean over 10.
    finding = found(GENTLY, cutouts({0.1: (9.0, 9.0, 9.0), 0.4: (8.4, 8.5, 8.6), 0.9: last}))
    assert (finding.verdict, finding.value) == (verdict, pytest.approx(loss))


@pytest.mark.parametrize("rule", [FALLS, GENTLY])
def test_a_trend_needs_three_fractions(rule: Rule) -> None:
    with pytest.raises(InsufficientData, match=r"2 finished seeds of push/gnn_ppo/cutout-0.40"):
        found(rule, cutouts({0.1: (9.0, 9.0, 9.0), 0.4: (8.0, 8.0), 0.9: (7.0, 7.0, 7.0)}))


@pytest.mark.parametrize(
    ("returns", "verdict", "rate"),
    [
        ((5.0, 6.0, 7.0), SUPPORTED, 1.0),
        ((1.0, 1.0, 1.0), CONTRADICTED, 0.0),
        ((1.0, 1.0, 9.0), UNDECIDED, 1.0 / 3.0),
    ],
)
def test_a_significant_portion_is_a_quarter(returns: Sequence[float], verdict: str, rate: float) -> None:
    finding = found(PORTION, cutouts({0.9: returns}))
    assert (finding.verdict, finding.value) == (verdict, pytest.approx(rate))


@pytest.mark.parametrize(
    ("solved", "verdict", "rate"),
    [
        ([(1, 1), (1, 1), (1, 1)], SUPPORTED, 1.0),
        ([(0, 0), (0, 0), (0, 1)], UNDECIDED, 1.0 / 6.0),
        ([(0, 0), (0, 0), (0, 0)], CONTRADICTED, 0.0),
    ],
)
def test_instances_outside_the_region_are_solved_by_more_than_half(
    solved: Sequence[Sequence[int]], verdict: str, rate: float
) -> None:
    columns = {"seed": np.repeat([0, 1, 2], 2), "instance": [0, 1] * 3, "success": np.ravel(solved)}
    rule = zero_shot.outside_solved(TASK, OURS, "")
    finding = found(rule, Evidence(outside=cells(OURS, **columns)))
    assert (finding.verdict, finding.value, finding.n) == (verdict, pytest.approx(rate), "3 seeds, 2 instances")
    with pytest.raises(InsufficientData, match="0 seeds of push/gnn_ppo measured outside"):
        found(rule, Evidence())
    with pytest.raises(InsufficientData, match="2 seeds"):
        found(rule, Evidence(outside=cells(OURS, **columns).query("seed < 2")))
