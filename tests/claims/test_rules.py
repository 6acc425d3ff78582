"""Each kind of rule gives each verdict where it should; numbers can be checked by hand."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
import pytest

from codesign_bench.claims import comparison, fine_tuning, tools, tradeoff, zero_shot
from codesign_bench.claims.claim import Rule
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import CONTRADICTED, SUPPORTED, UNDECIDED, Finding, InsufficientData, above, below

TASK, OURS, OTHER = "push", "gnn_ppo", "cma_rl"


def found(rule: Rule, evidence: Evidence) -> Finding:
    """Return what a rule finds."""
    return rule.judge(evidence, np.random.default_rng(0))


def cells(method: str, variant: str = "default", *, task: str = TASK, **columns: Sequence[object]) -> pd.DataFrame:
    """Return rows of a frame that belong to one method, task and variant."""
    frame = pd.DataFrame(columns)
    return frame.assign(task=task, method=method, variant=variant)


def finals(method: str, returns: Sequence[float], variant: str = "default", *, task: str = TASK) -> pd.DataFrame:
    """Return final evaluations of one instance: seed s reaches `returns[s]`."""
    columns = {"seed": range(len(returns)), "return": returns, "success": [0] * len(returns)}
    return cells(method, variant, task=task, **columns)


def curves(
    method: str,
    returns: Sequence[Sequence[float]],
    variant: str = "default",
    *,
    steps: Sequence[int] = (0, 50, 100),
    task: str = TASK,
    success: Sequence[Sequence[float]] | None = None,
) -> pd.DataFrame:
    """Return learning curves: seed s goes through `returns[s]` at `steps`."""
    seeds = np.repeat(np.arange(len(returns)), len(steps))
    columns = {
        "seed": seeds,
        "env_steps": np.tile(steps, len(returns)),
        "return_mean": np.ravel(returns),
        "success_rate": np.zeros(len(seeds)) if success is None else np.ravel(success),
    }
    return cells(method, variant, task=task, **columns)


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


# The interval and the threshold ---------------------------------------------------------------------------------------


def test_a_verdict_needs_the_whole_interval_on_one_side() -> None:
    assert [above(0.1, 0.2, 0.0), above(-0.2, -0.1, 0.0), above(-0.1, 0.1, 0.0)] == [SUPPORTED, CONTRADICTED, UNDECIDED]
    assert [below(0.1, 0.2, 0.0), below(-0.2, -0.1, 0.0), below(-0.1, 0.1, 0.0)] == [CONTRADICTED, SUPPORTED, UNDECIDED]


def test_an_interval_that_touches_the_threshold_or_is_missing_decides_nothing() -> None:
    assert above(0.0, 1.0, 0.0) == below(0.0, 1.0, 0.0) == UNDECIDED
    assert above(math.nan, math.nan, 0.0) == below(math.nan, math.nan, 0.0) == UNDECIDED
    assert below(math.inf, math.inf, 1.0) == CONTRADICTED


# Comparing methods ----------------------------------------------------------------------------------------------------

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


# Tools and goals ------------------------------------------------------------------------------------------------------

VARY = tools.tools_vary(TASK, OURS, 6)
WIDTHS: Mapping[str, Mapping[str, float]] = {TASK: {"design_length": 2.0, "design_angle": 4.0, "design_fixed": 0.0}}


def designs(lengths: Sequence[Sequence[float]]) -> Evidence:
    """Return evidence on seeds whose tools have these lengths, one per goal, and an angle twice the length."""
    flat = np.ravel(lengths)
    columns = {
        "seed": np.repeat(np.arange(len(lengths)), len(lengths[0])),
        "design_length": flat,
        "design_angle": 2.0 * flat,
        "design_fixed": np.full(len(flat), 0.005),
        "return": np.zeros(len(flat)),
    }
    return Evidence(evaluations=cells(OURS, **columns), design_widths=WIDTHS)


def test_tools_that_goals_alone_tell_apart_have_share_one() -> None:
    finding = found(VARY, designs([(0.0, 1.0), (0.0, 1.0), (0.0, 1.0)]))
    assert (finding.verdict, finding.value, finding.n) == (SUPPORTED, 1.0, "3 seeds")


def test_one_tool_for_all_goals_has_share_zero_whatever_its_seeds_do() -> None:
    assert found(VARY, designs([(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)])).verdict == CONTRADICTED
    finding = found(VARY, designs([(1.0, 1.0), (1.0, 1.0), (1.0, 1.0)]))
    assert (finding.verdict, finding.value, finding.high) == (CONTRADICTED, 0.0, 0.0)


def test_seeds_that_disagree_are_undecided() -> None:
    assert found(VARY, designs([(0.0, 0.0), (0.0, 2.0), (1.0, 1.0)])).verdict == UNDECIDED


def test_the_share_of_goals_by_hand() -> None:
    # Lengths 0, 2, 4, 6 have variance 5; each seed's own two have variance 1. Units of ranges cancel.
    rows = designs([(0.0, 2.0), (4.0, 6.0)]).evaluations
    assert tools.goal_shares(rows, WIDTHS[TASK]).tolist() == pytest.approx([0.2, 0.2])


def test_parameters_count_in_widths_of_their_ranges() -> None:
    # Length 0 or 2 between goals (a whole range, variance 1/4), angle 0 or 2 between seeds (half of it, 1/16).
    rows = designs([(0.0, 2.0), (0.0, 2.0)]).evaluations.assign(design_angle=[0.0, 0.0, 2.0, 2.0])
    assert tools.goal_shares(rows, WIDTHS[TASK]).tolist() == pytest.approx([0.25 / (0.25 + 0.0625)] * 2)


def test_a_task_that_is_not_known_is_lacking() -> None:
    with pytest.raises(InsufficientData, match="'push' is not known"):
        found(VARY, Evidence(evaluations=designs([(0.0,)] * 3).evaluations))


NO_SINGLE = tools.no_single_tool(TASK)


def tried(solves: Sequence[Sequence[int]], copies: int = 25) -> Evidence:
    """Return a design-sensitivity table in which each tool is there `copies` times."""
    rows = [
        {"task": TASK, "tool": tool, "goal": goal, "success": success}
        for tool, successes in enumerate(list(solves) * copies)
        for goal, success in enumerate(successes)
    ]
    return Evidence(sensitivity=pd.DataFrame(rows))


def test_no_single_tool_solves_all_that_can_be_solved() -> None:
    finding = found(NO_SINGLE, tried([(1, 1, 0, 0), (0, 1, 1, 0)]))
    assert (finding.verdict, finding.value) == (SUPPORTED, pytest.approx(2.0 / 3.0))
    assert finding.n == "50 tools, 3 of 4 goals"
    assert math.isnan(finding.low)


def test_a_tool_that_solves_all_that_can_be_solved_contradicts() -> None:
    finding = found(NO_SINGLE, tried([(1, 1, 0), (0, 1, 0)]))
    assert (finding.verdict, finding.value) == (CONTRADICTED, 1.0)


def test_few_tools_or_goals_say_nothing_of_tools_at_large() -> None:
    with pytest.raises(InsufficientData, match="4 tools and 2 goals"):
        found(NO_SINGLE, tried([(1, 0), (0, 1)], copies=2))
    with pytest.raises(InsufficientData, match="50 tools and 1 goals"):
        found(NO_SINGLE, tried([(1, 0), (0, 0)]))
    with pytest.raises(InsufficientData, match="not measured"):
        found(NO_SINGLE, Evidence())


# Unseen instances -----------------------------------------------------------------------------------------------------

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
    with pytest.raises(InsufficientData, match="nothing was learned"):
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


# Going on with one instance -------------------------------------------------------------------------------------------

WINS = fine_tuning.fine_tuning_wins(TASK, OURS, 2, ())
BEFORE = fine_tuning.unsolved_before(TASK, OURS, 2, ())
AFTER = fine_tuning.solved_after(TASK, OURS, 2, ())


def one_instance(tuned: Sequence[Sequence[float]], scratch: Sequence[Sequence[float]]) -> Evidence:
    """Return seeds whose returns on instance 2 go through these values; at 5 and above it is solved."""
    variants = {"finetune-2": tuned, "scratch-2": scratch}
    return Evidence(
        curves=pd.concat(
            [
                curves(OURS, returns, variant, success=[[float(value >= 5.0) for value in seed] for seed in returns])
                for variant, returns in variants.items()
            ]
        ),
        evaluations=pd.concat(
            [
                finals(OURS, [seed[-1] for seed in returns], variant).assign(
                    success=[int(seed[-1] >= 5.0) for seed in returns]
                )
                for variant, returns in variants.items()
            ]
        ),
    )


SLOW, QUICK = (0.0, 0.0, 8.0), (0.0, 8.0, 8.0)
"""Both end alike; straight between 0, 50 and 100 steps their means are 2 and 6."""


def test_fine_tuning_wins_if_it_is_quicker_though_both_end_alike() -> None:
    finding = found(WINS, one_instance([QUICK] * 3, [SLOW] * 3))
    assert (finding.verdict, finding.value, finding.low, finding.high) == (SUPPORTED, 4.0, 4.0, 4.0)
    assert found(WINS, one_instance([SLOW] * 3, [QUICK] * 3)).verdict == CONTRADICTED
    assert found(WINS, one_instance([QUICK, SLOW, SLOW], [SLOW, QUICK, SLOW])).verdict == UNDECIDED


def test_the_mean_along_a_curve_weighs_unequal_steps() -> None:
    # From 0 to 1 in 10 steps, then 1 for 30: (5 + 30) / 40.
    rows = curves(OURS, [(0.0, 1.0, 1.0)], steps=(0, 10, 40))
    assert fine_tuning.mean_along_curve(rows).tolist() == [0.875]
    assert fine_tuning.mean_along_curve(curves(OURS, [(3.0,)], steps=(0,))).tolist() == [3.0]


def test_fine_tuning_needs_learning_from_scratch_to_compare_with() -> None:
    evidence = one_instance([QUICK] * 3, [SLOW] * 2)
    with pytest.raises(InsufficientData, match="2 finished seeds of push/gnn_ppo/scratch-2"):
        found(WINS, evidence)


@pytest.mark.parametrize(
    ("solved", "before", "after"),
    [
        ([(0.0, 9.0, 9.0)] * 3, SUPPORTED, SUPPORTED),
        ([(9.0, 0.0, 0.0)] * 3, CONTRADICTED, CONTRADICTED),
        ([(9.0, 9.0, 9.0), (0.0, 0.0, 0.0), (0.0, 9.0, 9.0)], UNDECIDED, UNDECIDED),
    ],
)
def test_an_instance_is_solved_before_or_after_by_more_than_half_of_the_seeds(
    solved: Sequence[Sequence[float]], before: str, after: str
) -> None:
    evidence = one_instance(solved, [SLOW] * 3)
    assert (found(BEFORE, evidence).verdict, found(AFTER, evidence).verdict) == (before, after)
    assert found(BEFORE, evidence).value == pytest.approx(np.mean([seed[0] >= 5.0 for seed in solved]))
    assert found(AFTER, evidence).value == pytest.approx(np.mean([seed[-1] >= 5.0 for seed in solved]))


# Trading material against effort --------------------------------------------------------------------------------------

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


def test_every_rule_finds_the_same_twice() -> None:
    evidence = two_methods((1.0, 1.2, 1.4), (0.5, 0.6, 0.7))
    for rule in (HIGHER, FEWER):
        assert found(rule, evidence) == found(rule, evidence)
