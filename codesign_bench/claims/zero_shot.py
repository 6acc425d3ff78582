"""Rules about instances that were held out of training.

Shapes: `N` seeds, `R` resamples.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from codesign_bench.cell.variant import Variant
from codesign_bench.claims.claim import Rule
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import Finding, InsufficientData, above, below
from codesign_bench.claims.statistics import (
    FEWEST_LEVELS,
    OVER_SEEDS,
    at_each,
    estimate,
    mean,
    seeds_at_each,
    seeds_of,
    trend,
)
from codesign_bench.evaluation.extrapolation import RIM, load_or_measure
from codesign_bench.stats import MIN_SEEDS

CLOSE = 0.9
"""Unseen instances do as well as seen ones above this fraction of the seen return (ours)."""
GENTLE = 0.5
"""Largest loss of this fraction from one cutout fraction to the next for a gentle fall (ours)."""
OUTSIDE_SOLVED = 0.5
"""Instances outside the region count as solved above this success rate (ours)."""
SIGNIFICANT = 0.25
"""Success rate that counts as a significant portion (ours)."""


def unseen_close(task: str, method: str, fraction: float, needs: str) -> Rule:
    """Return the rule for "with the small cutout `fraction`, unseen instances do as well as seen ones"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        pairs = _seen_and_unseen(evidence, task, method, fraction)
        value, low, high = estimate([pairs], kept, rng)
        return Finding(above(low, high, CLOSE), value, low, high, seeds_of(pairs))

    return Rule(
        kind="unseen as good as seen",
        statistic="mean return on the cutout region, as a share of that on the training region",
        words=f"supported if {OVER_SEEDS} lies above {CLOSE:g}, contradicted if below {CLOSE:g}",
        needs=(needs,),
        judge=judge,
    )


def unseen_falls(task: str, method: str, fractions: Sequence[float], needs: str) -> Rule:
    """Return the rule for "the larger the cutout, the lower the return on unseen instances"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        found = at_each(fractions, lambda fraction: _seen_and_unseen(evidence, task, method, fraction)[:, 1])
        value, low, high = estimate(list(found.values()), trend(list(found)), rng)
        return Finding(below(low, high, 0.0), value, low, high, seeds_at_each(found))

    return Rule(
        kind="falls with the cutout",
        statistic="rank correlation of cutout fraction and mean return on the cutout region",
        words=f"over at least {FEWEST_LEVELS} fractions, supported if {OVER_SEEDS} lies below 0, contradicted if above",
        needs=(needs,),
        judge=judge,
    )


def unseen_falls_gently(task: str, method: str, fractions: Sequence[float], needs: str) -> Rule:
    """Return the rule for "the return on unseen instances falls gently as the cutout grows"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        found = at_each(fractions, lambda fraction: _seen_and_unseen(evidence, task, method, fraction))
        value, low, high = estimate(list(found.values()), largest_loss, rng)
        return Finding(below(low, high, GENTLE), value, low, high, seeds_at_each(found))

    return Rule(
        kind="falls gently",
        statistic="largest loss of the share that unseen is of seen return, from one fraction to the next",
        words=f"over at least {FEWEST_LEVELS} fractions, supported if {OVER_SEEDS} lies below {GENTLE:g}, "
        f"contradicted if above {GENTLE:g}",
        needs=(needs,),
        judge=judge,
    )


def unseen_solved(task: str, method: str, fraction: float, needs: str) -> Rule:
    """Return the rule for "with the large cutout `fraction`, a significant portion of unseen instances is solved"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        rows = _cutout_rows(evidence, task, method, fraction)
        rates = rows[rows["in_cutout"] > 0].groupby("seed")["success"].mean().to_numpy()
        value, low, high = estimate([rates], mean, rng)
        return Finding(above(low, high, SIGNIFICANT), value, low, high, seeds_of(rates))

    return Rule(
        kind="a significant portion solved",
        statistic="success rate on the cutout region",
        words=f"supported if {OVER_SEEDS} lies above {SIGNIFICANT:g}, contradicted if below {SIGNIFICANT:g}",
        needs=(needs,),
        judge=judge,
    )


def outside_solved(task: str, method: str, needs: str) -> Rule:
    """Return the rule for "policies solve instances outside the training region"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        frame = evidence.outside
        rows = frame[(frame["task"] == task) & (frame["method"] == method)] if len(frame) else frame
        rates = rows.groupby("seed")["success"].mean().to_numpy() if len(rows) else np.empty(0)
        if len(rates) < MIN_SEEDS:
            raise InsufficientData(
                f"{len(rates)} seeds of {task}/{method} measured outside the region; {MIN_SEEDS} are needed"
            )
        value, low, high = estimate([rates], mean, rng)
        n = f"{seeds_of(rates)}, {rows['instance'].nunique()} instances"
        return Finding(above(low, high, OUTSIDE_SOLVED), value, low, high, n)

    return Rule(
        kind="solved outside the region",
        statistic=f"success rate on instances up to {RIM:.0%} of the region's extent outside of it",
        words=f"supported if {OVER_SEEDS} lies above {OUTSIDE_SOLVED:g}, contradicted if below {OUTSIDE_SOLVED:g}",
        needs=(needs, "codesign-bench verify --measure --results {results}"),
        judge=judge,
        measure=lambda results, log: load_or_measure(results, [(task, method)], log, measure_missing=True),
    )


def kept(pairs: np.ndarray) -> np.ndarray:
    """Return (R,): mean unseen return divided by mean seen return, for pairs (R, N, 2) of seen and unseen."""
    means = pairs.mean(axis=1)
    # A ratio of means over seeds. Both returns of a seed are resampled together, since they are of the same policy.
    return np.asarray(means[:, 1] / means[:, 0])


def largest_loss(*samples: np.ndarray) -> np.ndarray:
    """Return (R,): the largest decrease of `kept` between successive samples (R, N, 2); negative if all increase."""
    return np.asarray((-np.diff([kept(sample) for sample in samples], axis=0)).max(axis=0))


def _cutout_rows(evidence: Evidence, task: str, method: str, fraction: float) -> pd.DataFrame:
    """Return the evaluation of cells with a held-out fraction of the region."""
    variant = Variant.of(cutout=fraction)
    rows = evidence.instances(task, method, variant)
    if "in_cutout" not in rows.columns or rows["in_cutout"].isna().any() or rows["in_cutout"].nunique() < 2:
        raise InsufficientData(f"no instances both in and outside the cutout of {task}/{method}/{variant.name}")
    return rows


def _seen_and_unseen(evidence: Evidence, task: str, method: str, fraction: float) -> np.ndarray:
    """Return (N, 2): each seed's mean return on the training region and on the cutout region."""
    rows = _cutout_rows(evidence, task, method, fraction)
    means = rows.groupby(["seed", "in_cutout"])["return"].mean().unstack("in_cutout").to_numpy()
    # A fraction of a return is meaningless if the return is not positive.
    if (means[:, 0] <= 0.0).any():
        raise InsufficientData(
            f"no learned behaviour to compare with: return {means[:, 0].min():.2f} on the training region"
        )
    return means
