"""Rules about instances that were never trained on, by numbers that can be checked by hand."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
import pytest

from codesign_bench.claims import zero_shot
from codesign_bench.claims.claim import Rule
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import CONTRADICTED, SUPPORTED, UNDECIDED, InsufficientData
from codesign_bench.evaluation.cutout_regions import INSTANCES
from evidence import OURS, TASK, cells, found

FRACTIONS = (0.1, 0.4, 0.9)
CLOSE = zero_shot.small_cutout_costs_little(TASK, OURS, 0.1, "")
GROWS = zero_shot.cost_grows(TASK, OURS, FRACTIONS, "")
GENTLY = zero_shot.cost_grows_gently(TASK, OURS, FRACTIONS, "")
PORTION = zero_shot.portion_solved(TASK, OURS, 0.9, "")


def regions(unseen: Mapping[float, Sequence[float]], seen: float = 10.0, instances: int = INSTANCES) -> Evidence:
    """Return seeds that get `unseen[fraction][seed]` on the region that they did not see, and `seen` if they saw it.

    Returns scatter by 1 around these means over the instances.
    """
    scatter = np.tile([-1.0, 1.0], instances // 2)
    parts = []
    for fraction, returns in unseen.items():
        for cutout, means in ((fraction, returns), (0.0, [seen] * len(returns))):
            for seed, mean in enumerate(means):
                columns = {"region": fraction, "cutout": cutout, "seed": seed}
                parts.append(pd.DataFrame({**columns, "instance": range(len(scatter)), "return": mean + scatter}))
    return Evidence(cutout_regions=pd.concat(parts).assign(task=TASK, method=OURS, success=0))


@pytest.mark.parametrize(
    ("returns", "verdict", "share"),
    [
        ((9.5, 9.6, 9.7), SUPPORTED, 0.96),
        ((8.2, 8.3, 8.4), CONTRADICTED, 0.83),
        ((8.0, 9.5, 9.8), UNDECIDED, 0.91),
        ((9.9, 9.9, 9.9), UNDECIDED, 0.99),
    ],
)
def test_a_small_cutout_costs_little_if_nine_tenths_are_kept(
    returns: Sequence[float], verdict: str, share: float
) -> None:
    finding = found(CLOSE, regions({0.1: returns}))
    assert (finding.verdict, finding.value) == (verdict, pytest.approx(share))
    assert finding.n == "3 seeds, 128 instances"


def test_the_interval_is_students() -> None:
    # Shares of 0.95, 0.96 and 0.97: standard error 0.01 / sqrt 3, two degrees of freedom.
    finding = found(CLOSE, regions({0.1: (9.5, 9.6, 9.7)}))
    half = 4.302653 * 0.01 / math.sqrt(3.0)
    assert (finding.low, finding.high) == pytest.approx((0.96 - half, 0.96 + half), rel=1e-6)
    # Against 0.9 t is 6 sqrt 3; with two degrees of freedom p is 1 - t / sqrt(2 + t^2).
    t = 6.0 * math.sqrt(3.0)
    assert finding.p == pytest.approx(1.0 - t / math.sqrt(2.0 + t**2))


def test_an_easy_region_is_no_merit_of_a_policy() -> None:
    # Unseen instances return 12, and so they do for a policy that saw them.
    shares = zero_shot.kept(regions({0.1: (12.0, 12.0, 12.0)}, seen=12.0), TASK, OURS, 0.1)
    assert shares.tolist() == pytest.approx([1.0, 1.0, 1.0])


def test_seeds_are_paired_and_those_without_a_partner_left_out() -> None:
    evidence = regions({0.1: (9.0, 8.0, 7.0, 6.0)})
    frame = evidence.cutout_regions
    alone = Evidence(cutout_regions=frame[(frame["seed"] != 1) | (frame["cutout"] > 0.0)])
    assert zero_shot.kept(alone, TASK, OURS, 0.1).tolist() == pytest.approx([0.9, 0.7, 0.6])
    with pytest.raises(InsufficientData, match=r"2 seeds of push/gnn_ppo played on the region 0\.1"):
        zero_shot.kept(regions({0.1: (9.0, 8.0)}), TASK, OURS, 0.1)


def test_what_is_lacking_is_told() -> None:
    with pytest.raises(InsufficientData, match=r"0 seeds .* played on the region 0\.1"):
        found(CLOSE, Evidence())
    with pytest.raises(InsufficientData, match=r"126 instances in the region 0\.1 of push; 128 are needed"):
        found(CLOSE, regions({0.1: (9.0, 8.0, 7.0)}, instances=126))
    with pytest.raises(InsufficientData, match="no learned behaviour"):
        found(CLOSE, regions({0.1: (1.0, 1.0, 1.0)}, seen=-0.1))


@pytest.mark.parametrize(
    ("middle", "last", "verdict", "trend"),
    [
        ((7.0, 7.6, 8.2), (4.0, 5.0, 6.0), SUPPORTED, -1.0),
        ((7.0, 7.6, 8.2), (9.0, 9.1, 9.2), UNDECIDED, 0.0),
        ((9.1, 9.2, 9.3), (9.2, 9.3, 9.4), UNDECIDED, 0.0),
    ],
)
def test_the_cost_grows_if_shares_fall_in_order(
    middle: Sequence[float], last: Sequence[float], verdict: str, trend: float
) -> None:
    # Shares of 0.9 to 0.92 first. Second case: 9 pairs fall, 9 rise, 9 are less than 0.05 apart. Third: all are.
    finding = found(GROWS, regions({0.1: (9.0, 9.1, 9.2), 0.4: middle, 0.9: last}))
    assert (finding.verdict, finding.value) == (verdict, pytest.approx(trend))
    assert finding.n == "3 seeds at each of 0.1, 0.4, 0.9"


def test_a_cost_that_shrinks_contradicts() -> None:
    finding = found(GROWS, regions({0.1: (4.0, 5.0, 6.0), 0.4: (7.0, 7.6, 8.2), 0.9: (9.0, 9.1, 9.2)}))
    assert (finding.verdict, finding.value) == (CONTRADICTED, 1.0)


@pytest.mark.parametrize(
    ("last", "verdict", "loss"),
    [
        ((6.4, 6.5, 6.6), SUPPORTED, 0.2),
        ((1.1, 1.2, 1.3), CONTRADICTED, 0.73),
        ((0.0, 5.0, 8.0), UNDECIDED, 0.85 - 13.0 / 30.0),
    ],
)
def test_a_gentle_growth_loses_less_than_half_at_a_step(last: Sequence[float], verdict: str, loss: float) -> None:
    # Shares 0.9, then 0.85, then the last one's mean over 10.
    finding = found(GENTLY, regions({0.1: (8.9, 9.0, 9.1), 0.4: (8.4, 8.5, 8.6), 0.9: last}))
    assert (finding.verdict, finding.value) == (verdict, pytest.approx(loss))
    assert finding.low < finding.value < finding.high


@pytest.mark.parametrize("rule", [GROWS, GENTLY])
def test_a_trend_needs_three_fractions(rule: Rule) -> None:
    with pytest.raises(InsufficientData, match=r"2 seeds of push/gnn_ppo played on the region 0\.4"):
        found(rule, regions({0.1: (9.0, 9.0, 9.0), 0.4: (8.0, 8.0), 0.9: (7.0, 7.0, 7.0)}))


@pytest.mark.parametrize(
    ("solved", "verdict", "rate"),
    [
        ((8, 9, 10), SUPPORTED, 0.9),
        ((0, 0, 1), CONTRADICTED, 1.0 / 30.0),
        ((0, 3, 10), UNDECIDED, 13.0 / 30.0),
    ],
)
def test_a_significant_portion_is_a_quarter(solved: Sequence[int], verdict: str, rate: float) -> None:
    # Ten instances of the cutout for each seed, of which so many are solved, and one elsewhere that does not count.
    columns = {
        "seed": np.repeat(np.arange(len(solved)), 11),
        "in_cutout": [1.0] * 10 + [0.0],
        "success": np.ravel([[int(number < wins) for number in range(10)] + [0] for wins in solved]),
    }
    columns["in_cutout"] = columns["in_cutout"] * len(solved)
    evidence = Evidence(evaluations=cells(OURS, "cutout-0.90", **columns))
    finding = found(PORTION, evidence)
    assert (finding.verdict, finding.value, finding.n) == (verdict, pytest.approx(rate), "3 seeds, 10 instances")
    with pytest.raises(InsufficientData, match="no instances in the cutout"):
        found(PORTION, Evidence(evaluations=evidence.evaluations.assign(in_cutout=0.0)))


@pytest.mark.parametrize(
    ("solved", "verdict", "rate"),
    [
        ([(1, 1, 1, 1), (1, 1, 1, 1), (1, 1, 1, 0)], SUPPORTED, 11.0 / 12.0),
        ([(0, 0, 0, 0), (0, 0, 1, 1), (1, 1, 1, 1)], UNDECIDED, 0.5),
        ([(0, 0, 0, 0), (0, 0, 0, 0), (0, 0, 0, 1)], CONTRADICTED, 1.0 / 12.0),
    ],
)
def test_instances_outside_the_region_are_solved_by_more_than_half(
    solved: Sequence[Sequence[int]], verdict: str, rate: float
) -> None:
    columns = {"seed": np.repeat([0, 1, 2], 4), "instance": [0, 1, 2, 3] * 3, "success": np.ravel(solved)}
    rule = zero_shot.outside_solved(TASK, OURS, "")
    finding = found(rule, Evidence(outside=cells(OURS, **columns)))
    assert (finding.verdict, finding.value, finding.n) == (verdict, pytest.approx(rate), "3 seeds, 4 instances")
    with pytest.raises(InsufficientData, match="0 seeds of push/gnn_ppo measured outside"):
        found(rule, Evidence())
    with pytest.raises(InsufficientData, match="2 seeds"):
        found(rule, Evidence(outside=cells(OURS, **columns).query("seed < 2")))
