"""Rules about fine-tuning a trained policy on one instance.

Shapes: `N` seeds.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.integrate import trapezoid

from codesign_bench.cell.variant import Variant
from codesign_bench.claims.claim import Rule
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import Finding, above, below
from codesign_bench.claims.statistics import OVER_SEEDS, check_budgets, difference, estimate, mean, seeds_of

SOLVED = 0.5
"""An instance counts as solved above this fraction of seeds (ours)."""


def fine_tuning_wins(task: str, method: str, number: int, needs: tuple[str, ...]) -> Rule:
    """Return the rule for "fine-tuning on instance `number` beats training from scratch"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        variants = (Variant.of(finetune=number), Variant.of(scratch=number))
        check_budgets(evidence, task, *((method, variant) for variant in variants))
        first, second = (mean_along_curve(evidence.curve(task, method, variant)) for variant in variants)
        value, low, high = estimate([first, second], difference, rng)
        return Finding(above(low, high, 0.0), value, low, high, seeds_of(first, second))

    return Rule(
        kind="fine-tuning wins",
        statistic="difference of mean returns along the whole curve, fine-tuned minus from scratch",
        words=f"supported if {OVER_SEEDS} lies above 0, contradicted if below 0",
        needs=needs,
        judge=judge,
    )


def mean_along_curve(rows: pd.DataFrame) -> np.ndarray:
    """Return (N,): each seed's return averaged along its linearly interpolated curve."""
    means = []
    for _, curve in rows.sort_values("env_steps").groupby("seed"):
        steps, returns = curve["env_steps"].to_numpy(dtype=np.float64), curve["return_mean"].to_numpy(dtype=np.float64)
        means.append(trapezoid(returns, steps) / (steps[-1] - steps[0]) if len(steps) > 1 else returns[0])
    return np.array(means, dtype=np.float64)


def unsolved_before(task: str, method: str, number: int, needs: tuple[str, ...]) -> Rule:
    """Return the rule for "before fine-tuning, the policy does not solve fine-tuning instance `number`"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        curves = evidence.curve(task, method, Variant.of(finetune=number)).sort_values("env_steps")
        rates = curves.groupby("seed")["success_rate"].first().to_numpy()
        value, low, high = estimate([rates], mean, rng)
        return Finding(below(low, high, SOLVED), value, low, high, seeds_of(rates))

    return Rule(
        kind="unsolved before fine-tuning",
        statistic="share of seeds that solve the instance before fine-tuning",
        words=f"supported if {OVER_SEEDS} lies below {SOLVED:g}, contradicted if above {SOLVED:g}",
        needs=needs,
        judge=judge,
    )


def solved_after(task: str, method: str, number: int, needs: tuple[str, ...]) -> Rule:
    """Return the rule for "after fine-tuning, the policy solves fine-tuning instance `number`"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        rows = evidence.instances(task, method, Variant.of(finetune=number))
        rates = rows.groupby("seed")["success"].mean().to_numpy()
        value, low, high = estimate([rates], mean, rng)
        return Finding(above(low, high, SOLVED), value, low, high, seeds_of(rates))

    return Rule(
        kind="solved after fine-tuning",
        statistic="share of seeds that solve the instance at the end of fine-tuning",
        words=f"supported if {OVER_SEEDS} lies above {SOLVED:g}, contradicted if below {SOLVED:g}",
        needs=needs,
        judge=judge,
    )
