"""Rules that compare two variants of methods across tasks, by numbers that can be checked by hand."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import pandas as pd
import pytest

from codesign_bench.cell.variant import Variant
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import CONTRADICTED, SUPPORTED, UNDECIDED, InsufficientData
from codesign_bench.claims.variants import Contrast, variant_ahead, variant_helps_more
from evidence import OTHER, OURS, curves, finals, found

JOINT, SEPARATE = (Variant.of(credit=name) for name in ("joint", "separate"))
TASKS = ("push", "scoop")
CONTRAST = Contrast(TASKS, JOINT, SEPARATE, ("a command",))
AHEAD = variant_ahead(CONTRAST, (OURS, OTHER))
MORE = variant_helps_more(CONTRAST, OURS, OTHER)
Finals = Mapping[tuple[str, str, Variant], Sequence[float]]


def around(mean: float, spread: float = 0.1) -> list[float]:
    """Return three seeds with this mean and standard deviation."""
    return [mean - spread, mean, mean + spread]


def evidence_on(returns: Finals, steps: int = 100) -> Evidence:
    """Return evidence in which seeds of each (task, method, variant) end with these returns."""
    return Evidence(
        curves=pd.concat(
            [
                curves(method, [(0.0, end) for end in ends], variant.name, steps=(0, steps), task=task)
                for (task, method, variant), ends in returns.items()
            ]
        ),
        evaluations=pd.concat(
            [finals(method, ends, variant.name, task=task) for (task, method, variant), ends in returns.items()]
        ),
    )


def two_by_two(*, ours: tuple[float, float], other: tuple[float, float], spread: float = 0.1) -> Finals:
    """Return the same returns on both tasks: the means (joint, separate) of two methods."""
    return {
        (task, method, variant): around(mean, spread)
        for task in TASKS
        for method, means in ((OURS, ours), (OTHER, other))
        for variant, mean in zip((JOINT, SEPARATE), means, strict=True)
    }


def test_differences_are_averaged_over_tasks_and_methods_as_shares_of_the_larger_mean() -> None:
    # Ours: 2 against 1, other: 1 against 0.8: shares of 0.5 and 0.2.
    finding = found(AHEAD, evidence_on(two_by_two(ours=(2.0, 1.0), other=(1.0, 0.8))))
    assert (finding.verdict, finding.value) == (SUPPORTED, pytest.approx(0.35))
    assert finding.n == "2 tasks, 2 methods, 3 seeds"
    assert finding.p < 0.01
    assert finding.note.startswith("above in ")


def test_the_second_variant_ahead_contradicts() -> None:
    finding = found(AHEAD, evidence_on(two_by_two(ours=(1.0, 2.0), other=(0.8, 1.0))))
    assert (finding.verdict, finding.value) == (CONTRADICTED, pytest.approx(-0.35))


def test_methods_that_disagree_are_undecided() -> None:
    finding = found(AHEAD, evidence_on(two_by_two(ours=(2.0, 1.0), other=(1.0, 2.0))))
    assert (finding.verdict, finding.value) == (UNDECIDED, pytest.approx(0.0))


def test_one_method_alone_can_be_asked_about() -> None:
    finding = found(variant_ahead(CONTRAST, (OTHER,)), evidence_on(two_by_two(ours=(2.0, 1.0), other=(1.0, 2.0))))
    assert (finding.verdict, finding.value, finding.n) == (
        CONTRADICTED,
        pytest.approx(-0.5),
        "2 tasks, 1 method, 3 seeds",
    )


def test_an_effect_below_a_twentieth_is_undecided() -> None:
    finding = found(AHEAD, evidence_on(two_by_two(ours=(1.0, 0.96), other=(1.0, 0.96), spread=0.001)))
    assert finding.low > 0.0
    assert finding.verdict == UNDECIDED
    assert "smaller than the least effect of 0.05" in finding.note


def test_gains_of_two_methods_are_compared() -> None:
    # Ours gains 1 of 2, other 0.2 of 1. Samples of ours, as shares, have a standard deviation of 0.05, of other 0.1.
    finding = found(MORE, evidence_on(two_by_two(ours=(2.0, 1.0), other=(1.0, 0.8))))
    assert (finding.verdict, finding.value) == (SUPPORTED, pytest.approx(0.3))
    assert finding.note == "gains +0.50 and +0.20"
    # Per task a sum of four means of three seeds, averaged over two tasks.
    error = math.sqrt(2.0 * (2.0 * 0.05**2 + 2.0 * 0.1**2) / 3.0) / 2.0
    # Satterthwaite: 2 (sum of v)^2 / sum of v^2, with four times v = 0.0025 and four times 0.01.
    freedom = 2.0 * (4.0 * 0.0025 + 4.0 * 0.01) ** 2 / (4.0 * 0.0025**2 + 4.0 * 0.01**2)
    assert freedom == pytest.approx(11.76, abs=0.01)
    t_quantile = 2.184  # 97.5 % with 11.76 degrees of freedom
    assert (finding.low, finding.high) == pytest.approx((0.3 - t_quantile * error, 0.3 + t_quantile * error), abs=1e-3)


def test_a_method_that_gains_less_contradicts() -> None:
    finding = found(MORE, evidence_on(two_by_two(ours=(1.0, 1.0), other=(2.0, 1.0))))
    assert (finding.verdict, finding.value) == (CONTRADICTED, pytest.approx(-0.5))


def test_equal_gains_are_undecided() -> None:
    finding = found(MORE, evidence_on(two_by_two(ours=(2.0, 1.0), other=(2.0, 1.0))))
    assert (finding.verdict, finding.value) == (UNDECIDED, pytest.approx(0.0))


def test_all_cells_are_needed() -> None:
    returns = dict(two_by_two(ours=(2.0, 1.0), other=(1.0, 0.8)))
    del returns["scoop", OTHER, SEPARATE]
    for rule in (AHEAD, MORE):
        with pytest.raises(InsufficientData, match="0 finished seeds of scoop/cma_rl/credit-separate; 3 are needed"):
            found(rule, evidence_on(returns))


def test_unequal_budgets_are_not_compared() -> None:
    returns = two_by_two(ours=(2.0, 1.0), other=(1.0, 0.8))
    long = evidence_on({key: ends for key, ends in returns.items() if key[2] == JOINT}, steps=200)
    short = evidence_on({key: ends for key, ends in returns.items() if key[2] == SEPARATE})
    both = Evidence(pd.concat([long.curves, short.curves]), pd.concat([long.evaluations, short.evaluations]))
    for rule in (AHEAD, MORE):
        with pytest.raises(InsufficientData, match="budgets differ on push: 200 and 100 environment steps"):
            found(rule, both)
