"""Rules about trading material against effort (the paper's equation 1).

Shapes: `N` seeds, `R` resamples.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from codesign_bench.cell.variant import Variant
from codesign_bench.claims.claim import Rule
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import Finding, InsufficientData, above, below
from codesign_bench.claims.statistics import FEWEST_LEVELS, OVER_SEEDS, at_each, estimate, mean, seeds_at_each, trend

MATERIAL, EFFORT, RATIO = "material", "effort", "ratio"
QUANTITIES = {
    MATERIAL: "mean material d_used/d_max",
    EFFORT: "mean effort c_used/c_max",
    RATIO: "ratio of mean material to mean effort",
}
"""Quantities that may depend on alpha, each a mean over evaluation instances of one seed."""


def rises_with_alpha(task: str, method: str, alphas: Sequence[float], quantity: str, needs: str) -> Rule:
    """Return the rule for "`quantity` rises with alpha", where `quantity` is one of `QUANTITIES`."""
    return _follows_alpha(task, method, alphas, quantity, needs, rises=True)


def falls_with_alpha(task: str, method: str, alphas: Sequence[float], quantity: str, needs: str) -> Rule:
    """Return the rule for "`quantity` falls as alpha rises", where `quantity` is one of `QUANTITIES`."""
    return _follows_alpha(task, method, alphas, quantity, needs, rises=False)


def _follows_alpha(task: str, method: str, alphas: Sequence[float], quantity: str, needs: str, *, rises: bool) -> Rule:
    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        found = at_each(alphas, lambda alpha: _quantity(evidence, task, method, alpha, quantity))
        value, low, high = estimate(list(found.values()), trend(list(found)), rng)
        verdict = above(low, high, 0.0) if rises else below(low, high, 0.0)
        return Finding(verdict, value, low, high, seeds_at_each(found))

    sides = ("above 0", "below 0") if rises else ("below 0", "above 0")
    return Rule(
        kind=f"{quantity} {'rises' if rises else 'falls'} with alpha",
        statistic=f"rank correlation of alpha and {QUANTITIES[quantity]}",
        words=f"over at least {FEWEST_LEVELS} values of alpha, supported if {OVER_SEEDS} lies {sides[0]}, "
        f"contradicted if {sides[1]}",
        needs=(needs,),
        judge=judge,
    )


def ratio_in_order(task: str, method: str, alphas: Sequence[float], needs: str) -> Rule:
    """Return the rule for "each larger alpha has a smaller ratio of material to effort"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        found = at_each(alphas, lambda alpha: _quantity(evidence, task, method, alpha, RATIO))
        value, low, high = estimate(list(found.values()), smallest_drop, rng)
        return Finding(above(low, high, 0.0), value, low, high, seeds_at_each(found))

    return Rule(
        kind="ratio in order of alpha",
        statistic=f"smallest drop of the {QUANTITIES[RATIO]} from one alpha to the next",
        words=f"over at least {FEWEST_LEVELS} values of alpha, supported if {OVER_SEEDS} lies above 0, "
        "contradicted if below 0",
        needs=(needs,),
        judge=judge,
    )


def smallest_drop(*samples: np.ndarray) -> np.ndarray:
    """Return (R,): the smallest decrease of the mean from one sample (R, N) to the next; negative if one increases."""
    return np.asarray((-np.diff([mean(sample) for sample in samples], axis=0)).min(axis=0))


def _quantity(evidence: Evidence, task: str, method: str, alpha: float, quantity: str) -> np.ndarray:
    """Return (N,): each seed's material, effort or their ratio."""
    variant = Variant.of(alpha=alpha)
    means = evidence.instances(task, method, variant).groupby("seed")[[MATERIAL, EFFORT]].mean()
    if quantity != RATIO:
        return means[quantity].to_numpy()
    if (means[EFFORT] <= 0.0).any():
        raise InsufficientData(f"a seed of {task}/{method}/{variant.name} never moves, so the ratio is infinite")
    # The ratio of means, not the mean of ratios: single episodes with hardly any effort would dominate the latter.
    return (means[MATERIAL] / means[EFFORT]).to_numpy()
