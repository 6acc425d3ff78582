"""Rules about going on with one instance, by numbers that can be checked by hand."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
import pytest

from codesign_bench.claims import fine_tuning
from codesign_bench.claims.claim import Rule
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import CONTRADICTED, SUPPORTED, UNDECIDED, InsufficientData
from evidence import OURS, TASK, cells, curves, finals, found

AHEAD = fine_tuning.fine_tuning_ahead(TASK, OURS, 2, ())
BEFORE = fine_tuning.most_fail_before(TASK, OURS, 2, ())
AFTER = fine_tuning.most_succeed_after(TASK, OURS, 2, ())


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


def with_scale(evidence: Evidence) -> Evidence:
    """Return the evidence with cells that vary nothing and end at 10, so that 0.5 is the least effect."""
    plain = finals(OURS, (10.0, 10.0, 10.0))
    return Evidence(evidence.curves, pd.concat([evidence.evaluations, plain]))


def shifted(curve: Sequence[float]) -> list[list[float]]:
    """Return a curve and the same 0.1 lower and higher."""
    return [[value + shift for value in curve] for shift in (-0.1, 0.0, 0.1)]


def test_fine_tuning_wins_if_it_is_quicker_though_both_end_alike() -> None:
    finding = found(AHEAD, with_scale(one_instance(shifted(QUICK), shifted(SLOW))))
    # Both have a standard deviation of 0.1: 4 -+ 2.776 * 0.1 sqrt(2 / 3).
    half = 2.776445 * 0.1 * math.sqrt(2.0 / 3.0)
    assert (finding.verdict, finding.value) == (SUPPORTED, pytest.approx(4.0))
    assert (finding.low, finding.high) == pytest.approx((4.0 - half, 4.0 + half), rel=1e-6)
    assert found(AHEAD, with_scale(one_instance(shifted(SLOW), shifted(QUICK)))).verdict == CONTRADICTED
    mixed = found(AHEAD, with_scale(one_instance([QUICK, SLOW, SLOW], [SLOW, QUICK, SLOW])))
    assert mixed.verdict == UNDECIDED


def test_a_small_lead_is_none() -> None:
    ahead = one_instance(shifted((0.4, 0.4, 8.4)), shifted(SLOW))
    finding = found(AHEAD, with_scale(ahead))
    assert (finding.verdict, finding.note) == (UNDECIDED, "smaller than the least effect of 0.5")


def test_fine_tuning_needs_learning_from_scratch_to_compare_with() -> None:
    evidence = one_instance([QUICK] * 3, [SLOW] * 2)
    with pytest.raises(InsufficientData, match="2 finished seeds of push/gnn_ppo/scratch-2"):
        found(AHEAD, evidence)


@pytest.mark.parametrize(
    ("seeds", "before", "after"),
    [
        ([(0.0, 9.0, 9.0)] * 6, SUPPORTED, SUPPORTED),
        ([(9.0, 0.0, 0.0)] * 6, CONTRADICTED, CONTRADICTED),
        ([(0.0, 9.0, 9.0)] * 5, UNDECIDED, UNDECIDED),
        ([(0.0, 9.0, 9.0)] * 5 + [(9.0, 0.0, 0.0)], UNDECIDED, UNDECIDED),
    ],
)
def test_six_seeds_of_one_kind_decide_and_five_do_not(
    seeds: Sequence[Sequence[float]], before: str, after: str
) -> None:
    evidence = one_instance(seeds, [SLOW] * 3)
    first, last = found(BEFORE, evidence), found(AFTER, evidence)
    assert (first.verdict, last.verdict) == (before, after)
    wins = sum(seed[-1] >= 5.0 for seed in seeds)
    assert (last.value, last.n) == (pytest.approx(wins / len(seeds)), f"{wins} of {len(seeds)} seeds")
    if wins in (0, len(seeds)):
        # The end of the exact interval of all or none of n, and p = 2 / 2^n.
        assert max(last.low, 1.0 - last.high) == pytest.approx(0.025 ** (1.0 / len(seeds)))
        assert last.p == pytest.approx(2.0 / 2.0 ** len(seeds))


@pytest.mark.parametrize("rule", [BEFORE, AFTER])
def test_four_seeds_say_nothing(rule: Rule) -> None:
    with pytest.raises(InsufficientData, match=r"of 4 seeds solve it; 5 seeds are needed"):
        found(rule, one_instance([(0.0, 9.0, 9.0)] * 4, [SLOW] * 3))


def test_a_seed_counts_once_however_many_instances_it_has() -> None:
    outcomes = {"seed": np.repeat(np.arange(6), 3), "return": np.zeros(18), "success": [1, 1, 0] * 5 + [1, 0, 0]}
    finding = found(AFTER, Evidence(evaluations=cells(OURS, "finetune-2", **outcomes)))
    assert (finding.n, finding.note) == ("5 of 6 seeds", "11 of 18 episodes, 3 instances of each seed")
    assert finding.value == pytest.approx(5 / 6)
