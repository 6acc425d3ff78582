"""Rules about going on with one instance, by numbers that can be checked by hand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
import pytest

from codesign_bench.claims import fine_tuning
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import CONTRADICTED, SUPPORTED, UNDECIDED, InsufficientData
from evidence import OURS, TASK, curves, finals, found

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
