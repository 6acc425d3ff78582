"""Rules that compare methods give each verdict where they should, by numbers that can be checked by hand."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
import pytest

from codesign_bench.claims import comparison
from codesign_bench.claims.claim import Rule
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import CEILING, CONTRADICTED, SUPPORTED, UNDECIDED, InsufficientData
from evidence import OTHER, OURS, TASK, curves, finals, found


def two_methods(
    ours: Sequence[float], other: Sequence[float], *, task: str = TASK, budget: int = 100, success: float = 0.0
) -> Evidence:
    """Return evidence on two methods whose seeds rise in a straight line from 0 to their final returns."""
    return Evidence(
        curves=pd.concat(
            [
                curves(OURS, [(0.0, 0.5 * end, end) for end in ours], task=task),
                curves(OTHER, [(0.0, end) for end in other], steps=(0, budget), task=task),
            ]
        ),
        evaluations=pd.concat(
            [finals(OURS, ours, task=task, success=success), finals(OTHER, other, task=task, success=success)]
        ),
    )


def both(*parts: Evidence) -> Evidence:
    """Return the evidence of several tasks together."""
    return Evidence(pd.concat([part.curves for part in parts]), pd.concat([part.evaluations for part in parts]))


NEEDS = ("codesign-bench run --method all",)
HIGHER = comparison.final_return_above(TASK, OURS, OTHER, NEEDS)
SOONER = comparison.sooner(TASK, OURS, OTHER, NEEDS)
T_4 = 2.776445
"""97.5 % quantile of the t distribution with 4 degrees of freedom."""


@pytest.mark.parametrize(
    ("ours", "other", "verdict", "difference"),
    [
        ((1.0, 1.2, 1.4), (0.4, 0.6, 0.8), SUPPORTED, 0.6),
        ((0.4, 0.6, 0.8), (1.0, 1.2, 1.4), CONTRADICTED, -0.6),
        ((0.0, 1.0, 2.0), (0.1, 0.9, 1.7), UNDECIDED, 0.1),
    ],
)
def test_final_returns_are_compared(
    ours: Sequence[float], other: Sequence[float], verdict: str, difference: float
) -> None:
    finding = found(HIGHER, two_methods(ours, other))
    assert finding.verdict == verdict
    assert finding.value == pytest.approx(difference)
    assert finding.low <= finding.value <= finding.high
    assert finding.n == "3 and 3 seeds"


def test_the_interval_is_welchs() -> None:
    # Both have a standard deviation of 0.2 and three seeds: standard error 0.2 sqrt(2 / 3), 4 degrees of freedom.
    finding = found(HIGHER, two_methods((1.0, 1.2, 1.4), (0.4, 0.6, 0.8)))
    half = T_4 * 0.2 * math.sqrt(2.0 / 3.0)
    assert (finding.low, finding.high) == pytest.approx((0.6 - half, 0.6 + half), rel=1e-6)
    # t = 0.6 / 0.163 = 3.674 with 4 degrees of freedom.
    assert finding.p == pytest.approx(0.0213, abs=1e-4)


def test_the_share_of_pairs_of_seeds_stands_beside_the_difference() -> None:
    # 0 equals 0: a half; 1 is above 0 and equals 1: one and a half; 2 is above 0 and 1: two. That is 4 of 9 pairs.
    finding = found(HIGHER, two_methods((0.0, 1.0, 2.0), (0.0, 1.0, 5.0)))
    assert finding.note == "above in 44% of pairs of seeds"


def test_a_difference_that_nobody_would_care_about_is_undecided() -> None:
    # A twentieth of 10.4 is 0.52: a difference of 0.4 is sure, and too small. So small is the interval of 90 % as well.
    finding = found(HIGHER, two_methods((10.39, 10.4, 10.41), (9.99, 10.0, 10.01)))
    assert (finding.verdict, finding.value) == (UNDECIDED, pytest.approx(0.4))
    assert finding.low > 0.0
    assert finding.note.endswith("smaller than the least effect of 0.52; equivalent within 0.52")


def test_where_both_solve_everything_the_difference_says_nothing() -> None:
    evidence = two_methods((1.0, 1.2, 1.4), (0.4, 0.6, 0.8), success=0.96)
    finding = found(HIGHER, evidence)
    assert (finding.verdict, finding.value) == (CEILING, pytest.approx(0.6))
    assert "both succeed in more than 95%" in finding.note
    almost = two_methods((1.0, 1.2, 1.4), (0.4, 0.6, 0.8), success=0.95)
    assert found(HIGHER, almost).verdict == SUPPORTED


def test_seeds_that_all_agree_decide_nothing() -> None:
    finding = found(HIGHER, two_methods((2.0, 2.0, 2.0), (1.0, 1.0, 1.0)))
    assert (finding.verdict, finding.value) == (UNDECIDED, 1.0)
    assert math.isnan(finding.p)
    assert "nothing is known of their spread" in finding.note


def test_a_method_gets_most_of_the_way_in_a_share_of_its_steps() -> None:
    # Straight lines from 0 in 100 steps; the lesser end is 1, so 0.9 is to be reached: after 0.9 / end of the steps.
    ours, other = (1.8, 2.0, 2.25), (0.8, 1.0, 1.2)
    finding = found(SOONER, two_methods(ours, other))
    first, second = [0.5, 0.45, 0.4], [1.0, 0.9, 0.75]
    assert finding.value == pytest.approx(np.mean(first) - np.mean(second))
    assert finding.verdict == SUPPORTED
    assert finding.note.startswith("0.45 against 0.88 of the budget; mean along the curve +0.51 [")
    swapped = found(comparison.sooner(TASK, OTHER, OURS, NEEDS), two_methods(ours, other))
    assert (swapped.verdict, swapped.value) == (CONTRADICTED, pytest.approx(-finding.value))


def test_a_seed_that_never_gets_there_takes_the_whole_budget() -> None:
    rows = curves(OURS, [(0.0, 0.5, 1.0), (0.0, 0.1, 0.2), (1.0, 1.0, 1.0)])
    assert comparison.shares_of_budget(rows, 0.5).tolist() == [0.5, 1.0, 0.0]


def test_one_lucky_evaluation_saves_no_steps() -> None:
    # 3 and 0 become 1.5 and 1.5; 2 is reached on the way from 1.5 at 50 to 4 at 75 steps.
    rows = curves(OURS, [(0.0, 3.0, 0.0, 4.0, 4.0)], steps=(0, 25, 50, 75, 100))
    assert comparison.shares_of_budget(rows, 2.0).tolist() == [pytest.approx(0.55)]


def test_the_mean_along_a_curve_is_one_per_seed() -> None:
    # From 0 to 1 in 10 steps, then 1 for 30: (5 + 30) / 40.
    rows = curves(OURS, [(0.0, 1.0, 1.0), (2.0, 2.0, 2.0)], steps=(0, 10, 40))
    assert comparison.means_along(rows).tolist() == [0.875, 2.0]


def test_few_steps_saved_are_none() -> None:
    finding = found(SOONER, two_methods((1.0, 1.001, 1.002), (0.97, 0.971, 0.972)))
    assert finding.verdict == UNDECIDED
    assert finding.high < 0.0
    assert "smaller than the least effect of 0.05" in finding.note


def test_a_baseline_that_learns_nothing_gives_nothing_to_reach() -> None:
    finding = found(SOONER, two_methods((1.0, 1.1, 1.2), (-0.1, -0.2, -0.3)))
    assert finding.verdict == UNDECIDED
    assert finding.note == "the lesser final return, -0.20, is no higher than the start, 0.00"


@pytest.mark.parametrize("rule", [HIGHER, SOONER])
def test_unequal_budgets_are_not_compared(rule: Rule) -> None:
    ours, other = (2.0, 2.1, 2.2), (0.4, 0.5, 0.6)
    with pytest.raises(InsufficientData, match="budgets differ on push: 100 and 200 environment steps"):
        found(rule, two_methods(ours, other, budget=200))
    assert found(rule, two_methods(ours, other, budget=109)).verdict == SUPPORTED


@pytest.mark.parametrize("rule", [HIGHER, SOONER])
def test_two_seeds_are_not_enough(rule: Rule) -> None:
    with pytest.raises(InsufficientData, match="2 finished seeds of push/cma_rl/default; 3 are needed"):
        found(rule, two_methods((1.0, 1.0, 1.0), (0.0, 0.0)))
    with pytest.raises(InsufficientData, match="0 finished seeds of push/gnn_ppo/default"):
        found(rule, Evidence())


def test_unfinished_seeds_do_not_count() -> None:
    evidence = two_methods((1.0, 1.2, 1.4), (0.5, 0.6, 0.7))
    running = curves(OURS, [(9.0,), (9.0,), (9.0,), (9.0,)], steps=(10,))
    more = Evidence(pd.concat([evidence.curves, running[running["seed"] == 3]]), evidence.evaluations)
    for rule in (HIGHER, SOONER):
        assert repr(found(rule, more)) == repr(found(rule, evidence))


ACROSS = comparison.ahead_across_tasks(("push", "scoop"), OURS, OTHER, NEEDS)


def test_differences_are_averaged_over_tasks_in_units_of_each() -> None:
    # The largest means are 2 and 20; the differences 1 and 4 are 0.5 and 0.2 of them.
    evidence = both(
        two_methods((1.9, 2.0, 2.1), (0.9, 1.0, 1.1)), two_methods((19.0, 20.0, 21.0), (15.0, 16.0, 17.0), task="scoop")
    )
    finding = found(ACROSS, evidence)
    assert (finding.verdict, finding.value, finding.n) == (SUPPORTED, pytest.approx(0.35), "2 tasks, 3-3 seeds")
    # Every sample has a standard deviation of a twentieth: variance 4 * 0.05^2 / 3 / 2^2, 8 degrees of freedom.
    half = 2.306004 * 0.05 / math.sqrt(3.0)
    assert (finding.low, finding.high) == pytest.approx((0.35 - half, 0.35 + half), rel=1e-6)
    # Of 20 * 20 ways of dealing out the scores, this one and its opposite are the most extreme.
    assert finding.p == pytest.approx(2 / 400)
    assert finding.note == "above in 100% of pairs of seeds; interquartile means 1.00 and 0.65"


def test_tasks_that_disagree_are_undecided() -> None:
    won, lost = (1.9, 2.0, 2.1), (0.9, 1.0, 1.1)
    finding = found(ACROSS, both(two_methods(won, lost), two_methods(lost, won, task="scoop")))
    assert (finding.verdict, finding.value) == (UNDECIDED, pytest.approx(0.0))


def test_losing_on_all_tasks_contradicts() -> None:
    lost = [two_methods((0.0, 0.0, 0.1), (0.9, 1.0, 1.1), task=task) for task in ("push", "scoop")]
    finding = found(ACROSS, both(*lost))
    assert (finding.verdict, finding.value) == (CONTRADICTED, pytest.approx(-29.0 / 30.0))


def test_a_claim_about_all_tasks_needs_all_tasks() -> None:
    with pytest.raises(InsufficientData, match="scoop"):
        found(ACROSS, two_methods((1.0, 1.2, 1.4), (0.5, 0.6, 0.7)))


def test_every_rule_finds_the_same_twice() -> None:
    evidence = two_methods((1.0, 1.2, 1.4), (0.5, 0.6, 0.7))
    for rule in (HIGHER, SOONER):
        assert repr(found(rule, evidence)) == repr(found(rule, evidence))
