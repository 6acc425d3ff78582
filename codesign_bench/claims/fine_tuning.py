"""Rules about fine-tuning a trained policy at one place outside the training region.

Shapes: `N` seeds.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from codesign_bench import stats
from codesign_bench.cell.variant import Variant
from codesign_bench.claims.claim import Rule
from codesign_bench.claims.comparison import means_along
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import Finding, InsufficientData, above, below, reason
from codesign_bench.claims.statistics import (
    EFFECT_SCALE,
    LEAST_SHARE,
    WELCH_INTERVAL,
    check_budgets,
    effect_scale,
    seeds_of,
)

SOLVED = 0.5
"""An instance counts as solved above this fraction of a seed's instances, and of seeds (ours)."""
FEWEST_SEEDS = 5
"""Fewest seeds that decide a claim about outcomes of 0 or 1 (ours): four equal ones are not yet rare."""
SEEDS_TO_DECIDE = 8
"""Seeds that can decide four such claims together: if all are equal, p = 2 / 2^8, times 4 below 0.05."""
EXACT_INTERVAL = "the exact 95 % interval (Clopper and Pearson)"


def fine_tuning_ahead(task: str, method: str, number: int, needs: tuple[str, ...]) -> Rule:
    """Return the rule for "fine-tuning at place `number` beats training from scratch"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # nothing is drawn
        variants = (Variant.of(finetune=number), Variant.of(scratch=number))
        check_budgets(evidence, task, *((method, variant) for variant in variants))
        first, second = (means_along(evidence.curve(task, method, variant)) for variant in variants)
        least = LEAST_SHARE * effect_scale(evidence, task)
        found = stats.welch(first, second)
        n, told = seeds_of(first, second), reason(found, least=least)
        return Finding(above(found, least=least), found.value, found.low, found.high, n, told, found.p)

    return Rule(
        kind="fine-tuning ahead along the curve",
        statistic="difference of mean returns along the whole curve, fine-tuned minus from scratch",
        words=f"supported if {WELCH_INTERVAL} is above 0 and the difference is at least {LEAST_SHARE:.0%} of "
        f"{EFFECT_SCALE}, contradicted if the same holds below 0",
        needs=needs,
        judge=judge,
    )


def most_fail_before(task: str, method: str, number: int, needs: tuple[str, ...]) -> Rule:
    """Return the rule for "before fine-tuning, the policy fails at fine-tuning place `number`"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # nothing is drawn
        curves = evidence.curve(task, method, Variant.of(finetune=number)).sort_values("env_steps")
        return _judged(curves.groupby("seed")["success_rate"].first(), "", solved=False)

    return Rule(
        kind="most seeds fail before fine-tuning",
        statistic=f"share of seeds that solve more than {SOLVED:g} of the instances at the start before fine-tuning",
        words=f"over at least {FEWEST_SEEDS} seeds, supported if {EXACT_INTERVAL} is below {SOLVED:g}, "
        f"contradicted if above {SOLVED:g}",
        needs=needs,
        judge=judge,
    )


def most_succeed_after(task: str, method: str, number: int, needs: tuple[str, ...]) -> Rule:
    """Return the rule for "after fine-tuning, the policy succeeds at fine-tuning place `number`"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # nothing is drawn
        rows = evidence.instances(task, method, Variant.of(finetune=number))
        outcomes = rows.groupby("seed")["success"]
        count, solved = int(outcomes.size().min()), int(rows["success"].sum())
        told = "" if count == 1 else f"{solved} of {len(rows)} episodes, {count} instances of each seed"
        return _judged(outcomes.mean(), told, solved=True)

    return Rule(
        kind="most seeds succeed after fine-tuning",
        statistic=f"share of seeds that solve more than {SOLVED:g} of the instances at the start after fine-tuning",
        words=f"over at least {FEWEST_SEEDS} seeds, supported if {EXACT_INTERVAL} is above {SOLVED:g}, "
        f"contradicted if below {SOLVED:g}",
        needs=needs,
        judge=judge,
    )


def _judged(rates: pd.Series, told: str, *, solved: bool) -> Finding:
    """Return what follows from the success rate of each seed.

    Instances of one seed succeed or fail together, so that each seed counts once, however many instances it has.

    Raises:
        InsufficientData: there are too few seeds.
    """
    wins, seeds = int((rates > SOLVED).sum()), len(rates)
    if seeds < FEWEST_SEEDS:
        counted = f"{wins} of {seeds} seeds solve it"
        raise InsufficientData(f"{counted}; {FEWEST_SEEDS} seeds are needed")
    found = stats.proportion_test(wins, seeds, SOLVED)
    verdict = above(found, SOLVED) if solved else below(found, SOLVED)
    return Finding(verdict, found.value, found.low, found.high, f"{wins} of {seeds} seeds", told, found.p)
