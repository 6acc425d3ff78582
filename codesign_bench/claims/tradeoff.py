"""Rules about trading material against effort (the paper's equation 1).

Shapes: `N` seeds.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from codesign_bench import stats
from codesign_bench.cell.variant import Variant
from codesign_bench.claims.claim import Rule
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import (
    CONTRADICTED,
    LEVEL,
    SUPPORTED,
    UNDECIDED,
    Finding,
    InsufficientData,
    above,
    joined,
    reason,
)
from codesign_bench.claims.statistics import FEWEST_LEVELS, LEAST_SHARE, at_each, largest_of, seeds_at_each

MATERIAL, EFFORT, RATIO = "material", "effort", "ratio"
QUANTITIES = {
    MATERIAL: "mean material d_used/d_max",
    EFFORT: "mean effort c_used/c_max",
    RATIO: "ratio of mean material to mean effort",
}
"""Quantities that may depend on alpha, each a mean over evaluation instances of one seed."""
LEAST_WORDS = f"{LEAST_SHARE:.0%} of the larger of the means at the smallest and the largest alpha"


def rises_with_alpha(task: str, method: str, alphas: Sequence[float], quantity: str, needs: str) -> Rule:
    """Return the rule for "`quantity` rises with alpha", where `quantity` is one of `QUANTITIES`."""
    return _follows_alpha(task, method, alphas, quantity, needs, rises=True)


def falls_with_alpha(task: str, method: str, alphas: Sequence[float], quantity: str, needs: str) -> Rule:
    """Return the rule for "`quantity` falls as alpha rises", where `quantity` is one of `QUANTITIES`."""
    return _follows_alpha(task, method, alphas, quantity, needs, rises=False)


def _follows_alpha(task: str, method: str, alphas: Sequence[float], quantity: str, needs: str, *, rises: bool) -> Rule:
    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        found = at_each(alphas, lambda alpha: _quantity(evidence, task, method, alpha, quantity))
        samples = list(found.values())
        least = least_change(samples)
        trend, p = stats.jonckheere_p(samples, rng, same=least)
        change = float(samples[-1].mean() - samples[0].mean())
        verdict = UNDECIDED
        if p < LEVEL and abs(change) >= least and trend * change > 0.0:
            verdict = SUPPORTED if (trend > 0.0) == rises else CONTRADICTED
        told = f"means {', '.join(f'{sample.mean():.2f}' for sample in samples)}"
        return Finding(verdict, trend, n=seeds_at_each(found), note=told, p=p)

    way, other = ("rises", "falls") if rises else ("falls", "rises")
    return Rule(
        kind=f"{quantity} trends {'up' if rises else 'down'} with alpha",
        statistic=f"Jonckheere's trend, from -1 to 1, of the {QUANTITIES[quantity]} over alpha; values less than the "
        "least change apart are equal",
        words=f"over at least {FEWEST_LEVELS} values of alpha, supported if it {way} with p below {LEVEL:g} and by at "
        f"least {LEAST_WORDS}, contradicted if it {other} as clearly",
        needs=(needs,),
        judge=judge,
    )


def ratio_drops_each_time(task: str, method: str, alphas: Sequence[float], needs: str) -> Rule:
    """Return the rule for "each larger alpha has a smaller ratio of material to effort"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # nothing is drawn
        found = at_each(alphas, lambda alpha: _quantity(evidence, task, method, alpha, RATIO))
        samples = list(found.values())
        steps = list(pairwise(samples))
        wide = 1.0 - (1.0 - stats.CONFIDENCE) / len(steps)
        rises = largest_of(
            [stats.welch(after, before) for before, after in steps],
            [stats.welch(after, before, confidence=wide) for before, after in steps],
            threshold=0.0,
        )
        smallest = stats.Estimate(-rises.value, -rises.high, -rises.low, rises.p)
        least = least_change(samples)
        means = f"means {', '.join(f'{sample.mean():.2f}' for sample in samples)}"
        told, n = joined(means, reason(smallest, least=least)), seeds_at_each(found)
        verdict = above(smallest, least=least)
        return Finding(verdict, smallest.value, smallest.low, smallest.high, n, told, smallest.p)

    return Rule(
        kind="ratio drops at each alpha",
        statistic=f"smallest drop of the {QUANTITIES[RATIO]} from one alpha to the next",
        words=f"over at least {FEWEST_LEVELS} values of alpha, supported if the 95 % Welch interval of every drop is "
        f"above 0 and every drop is at least {LEAST_WORDS}, contradicted if it rises as much once, with an interval "
        "widened for the number of steps",
        needs=(needs,),
        judge=judge,
    )


def least_change(samples: Sequence[np.ndarray]) -> float:
    """Return the smallest change that counts, from the seeds (N,) at each alpha in rising order."""
    return LEAST_SHARE * max(abs(float(samples[0].mean())), abs(float(samples[-1].mean())))


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
