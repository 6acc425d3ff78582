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
from codesign_bench.claims.finding import CONTRADICTED, SUPPORTED, UNDECIDED, InsufficientData
from evidence import OTHER, OURS, TASK, curves, finals, found


def two_methods(ours: Sequence[float], other: Sequence[float], *, task: str = TASK, budget: int = 100) -> Evidence:
    """Return evidence on two methods whose seeds rise in a straight line from 0 to their final returns."""
    return Evidence(
        curves=pd.concat(
            [
                curves(OURS, [(0.0, 0.5 * end, end) for end in ours], task=task),
                curves(OTHER, [(0.0, end) for end in other], steps=(0, budget), task=task),
            ]
        ),
        evaluations=pd.concat([finals(OURS, ours, task=task), finals(OTHER, other, task=task)]),
    )


def both(*parts: Evidence) -> Evidence:
    """Return the evidence of several tasks together."""
    return Evidence(pd.concat([part.curves for part in parts]), pd.concat([part.evaluations for part in parts]))


HIGHER = comparison.higher_final_return(TASK, OURS, OTHER, 6)
FEWER = comparison.fewer_steps(TASK, OURS, OTHER, 6)


@pytest.mark.parametrize(
    ("ours", "other", "verdict", "difference"),
    [
        ((1.0, 1.2, 1.4), (0.5, 0.6, 0.7), SUPPORTED, 0.6),
        ((0.5, 0.6, 0.7), (1.0, 1.2, 1.4), CONTRADICTED, -0.6),
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


def test_the_share_of_pairs_of_seeds_stands_beside_the_difference() -> None:
    # 0 equals 0: a half; 1 is above 0 and equals 1: one and a half; 2 is above 0 and 1: two. That is 4 of 9 pairs.
    finding = found(HIGHER, two_methods((0.0, 1.0, 2.0), (0.0, 1.0, 5.0)))
    assert finding.note == "above in 44% of pairs of seeds"


def test_a_method_reaches_the_others_return_in_a_share_of_its_steps() -> None:
    # Straight from 0 to 2 in 100 steps: the mean of 0.5 is passed at step 25.
    finding = found(FEWER, two_methods((2.0, 2.0, 2.0), (0.4, 0.5, 0.6)))
    assert (finding.verdict, finding.value) == (SUPPORTED, pytest.approx(0.25))
    assert (finding.low, finding.high) == (pytest.approx(0.2), pytest.approx(0.3))


def test_a_return_that_is_never_reached_takes_for_ever() -> None:
    finding = found(FEWER, two_methods((0.4, 0.5, 0.6), (2.0, 2.0, 2.0)))
    assert (finding.verdict, finding.value, finding.low, finding.high) == (CONTRADICTED, math.inf, math.inf, math.inf)


def test_a_return_that_is_reached_in_some_resamples_only_is_undecided() -> None:
    finding = found(FEWER, two_methods((0.0, 1.0, 2.0), (0.8, 0.9, 1.0)))
    assert (finding.verdict, finding.value, finding.high) == (UNDECIDED, pytest.approx(0.9), math.inf)


def test_a_baseline_that_learns_nothing_is_told() -> None:
    finding = found(FEWER, two_methods((1.0, 1.0, 1.0), (-0.1, -0.2, -0.3)))
    assert (finding.verdict, finding.value) == (SUPPORTED, 0.0)
    assert finding.note == "cma_rl ends no higher than gnn_ppo begins"


def test_steps_lie_on_the_line_between_two_evaluations() -> None:
    curve = np.array([[0.0, 1.0, 3.0], [0.0, 1.0, 3.0], [0.0, 3.0, 1.0], [0.0, 0.0, 0.0]])
    reached = comparison.steps_to_reach(np.array([0.0, 10.0, 20.0]), curve, np.array([2.0, 0.0, 3.0, 1.0]))
    assert reached.tolist() == [15.0, 0.0, 10.0, math.inf]


@pytest.mark.parametrize("rule", [HIGHER, FEWER])
def test_unequal_budgets_are_not_compared(rule: Rule) -> None:
    with pytest.raises(InsufficientData, match="budgets differ on push: 100 and 200 environment steps"):
        found(rule, two_methods((1.0, 1.0, 1.0), (0.0, 0.0, 0.0), budget=200))
    assert found(rule, two_methods((1.0, 1.0, 1.0), (0.1, 0.1, 0.1), budget=109)).verdict == SUPPORTED


@pytest.mark.parametrize("rule", [HIGHER, FEWER])
def test_two_seeds_are_not_enough(rule: Rule) -> None:
    with pytest.raises(InsufficientData, match="2 finished seeds of push/cma_rl/default; 3 are needed"):
        found(rule, two_methods((1.0, 1.0, 1.0), (0.0, 0.0)))
    with pytest.raises(InsufficientData, match="0 finished seeds of push/gnn_ppo/default"):
        found(rule, Evidence())


def test_unfinished_seeds_do_not_count() -> None:
    evidence = two_methods((1.0, 1.2, 1.4), (0.5, 0.6, 0.7))
    running = curves(OURS, [(9.0,), (9.0,), (9.0,), (9.0,)], steps=(10,))
    more = Evidence(pd.concat([evidence.curves, running[running["seed"] == 3]]), evidence.evaluations)
    assert found(HIGHER, more) == found(HIGHER, evidence)
    assert found(FEWER, more) == found(FEWER, evidence)


ACROSS = comparison.better_across_tasks(("push", "scoop"), OURS, OTHER, {"push": 6, "scoop": 3})


@pytest.mark.parametrize(
    ("second_task", "verdict", "probability"),
    [
        (((2.0, 3.0, 4.0), (0.0, 1.0, 2.5)), SUPPORTED, (1.0 + 8.0 / 9.0) / 2.0),
        (((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)), UNDECIDED, 0.5),
    ],
)
def test_improvement_is_averaged_over_tasks(
    second_task: tuple[Sequence[float], Sequence[float]], verdict: str, probability: float
) -> None:
    evidence = both(two_methods((1.0, 1.2, 1.4), (0.5, 0.6, 0.7)), two_methods(*second_task, task="scoop"))
    finding = found(ACROSS, evidence)
    assert (finding.verdict, finding.value) == (verdict, pytest.approx(probability))
    assert finding.n == "2 tasks, 3-3 seeds"


def test_losing_on_all_tasks_contradicts() -> None:
    lost = [two_methods((0.0, 0.0, 0.1), (1.0, 1.0, 1.0), task=task) for task in ("push", "scoop")]
    finding = found(ACROSS, both(*lost))
    assert (finding.verdict, finding.value) == (CONTRADICTED, 0.0)


def test_a_claim_about_all_tasks_needs_all_tasks() -> None:
    with pytest.raises(InsufficientData, match="scoop"):
        found(ACROSS, two_methods((1.0, 1.2, 1.4), (0.5, 0.6, 0.7)))


def test_every_rule_finds_the_same_twice() -> None:
    evidence = two_methods((1.0, 1.2, 1.4), (0.5, 0.6, 0.7))
    for rule in (HIGHER, FEWER):
        assert found(rule, evidence) == found(rule, evidence)
