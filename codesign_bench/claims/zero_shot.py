"""Rules about instances that were held out of training.

Some regions of a task are easier than others. What a policy keeps of its return where it was not trained is therefore
measured against policies of the same method that were trained on everything, on the same instances.

Shapes: `N` seeds.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd

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
    below,
    joined,
    reason,
)
from codesign_bench.claims.statistics import (
    FEWEST_LEVELS,
    LEAST_SHARE,
    T_INTERVAL,
    at_each,
    largest_of,
    seeds_at_each,
    seeds_of,
)
from codesign_bench.console import Log
from codesign_bench.evaluation.cutout_regions import INSTANCES, measure_cutout_regions
from codesign_bench.evaluation.extrapolation import RIM, load_or_measure
from codesign_bench.stats import MIN_SEEDS

CLOSE = 0.9
"""Unseen instances do as well as seen ones above this fraction of the return of policies that saw them (ours)."""
GENTLE = 0.5
"""Largest loss of this fraction from one cutout fraction to the next for a gentle fall (ours)."""
OUTSIDE_SOLVED = 0.5
"""Instances outside the region count as solved above this success rate (ours)."""
SIGNIFICANT = 0.25
"""Success rate that counts as a significant portion (ours)."""
MEASURE = "codesign-bench verify --measure --results {results}"
KEPT = "return on the cutout region, as a share of that of policies without a cutout on the same instances"


def small_cutout_costs_little(task: str, method: str, fraction: float, needs: str) -> Rule:
    """Return the rule for "with the small cutout `fraction`, unseen instances are handled like seen ones"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # nothing is drawn
        shares = kept(evidence, task, method, fraction)
        found, n = stats.one_sample_t(shares, CLOSE), _with_instances(shares)
        told = reason(found, CLOSE)
        return Finding(above(found, CLOSE), found.value, found.low, found.high, n, told, found.p)

    return Rule(
        kind="a small cutout costs little",
        statistic=f"{KEPT}, seed by seed",
        words=f"over at least {INSTANCES} instances, supported if {T_INTERVAL} is above {CLOSE:g}, contradicted if "
        f"below {CLOSE:g}",
        needs=(needs, MEASURE),
        judge=judge,
        measure=_measure(task, method, (fraction,)),
    )


def cost_grows(task: str, method: str, fractions: Sequence[float], needs: str) -> Rule:
    """Return the rule for "the larger the cutout, the lower the return on unseen instances"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        found = at_each(fractions, lambda fraction: kept(evidence, task, method, fraction))
        samples = list(found.values())
        trend, p = stats.jonckheere_p(samples, rng, same=LEAST_SHARE)
        fall = float(samples[0].mean() - samples[-1].mean())
        decided = p < LEVEL and abs(fall) >= LEAST_SHARE
        verdict = UNDECIDED if not decided else SUPPORTED if trend < 0.0 < fall else CONTRADICTED
        told = f"share kept: {', '.join(f'{sample.mean():.2f}' for sample in samples)}"
        return Finding(verdict, trend, n=seeds_at_each(found), note=told, p=p)

    return Rule(
        kind="the cost grows with the cutout",
        statistic=f"Jonckheere's trend, from -1 to 1, of the {KEPT}; shares less than {LEAST_SHARE:g} apart are equal",
        words=f"over at least {FEWEST_LEVELS} fractions, supported if the trend falls with p below {LEVEL:g} and the "
        f"share by at least {LEAST_SHARE:g} from first to last, contradicted if it rises as clearly",
        needs=(needs, MEASURE),
        judge=judge,
        measure=_measure(task, method, fractions),
    )


def cost_grows_gently(task: str, method: str, fractions: Sequence[float], needs: str) -> Rule:
    """Return the rule for "the return on unseen instances falls gently as the cutout grows"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # nothing is drawn
        found = at_each(fractions, lambda fraction: kept(evidence, task, method, fraction))
        samples = list(found.values())
        losses = [_loss(before, after) for before, after in pairwise(samples)]
        wide = 1.0 - (1.0 - stats.CONFIDENCE) / len(losses)
        wider = [_loss(before, after, wide) for before, after in pairwise(samples)]
        largest = largest_of(losses, wider, GENTLE)
        told = joined(f"share kept: {', '.join(f'{s.mean():.2f}' for s in samples)}", reason(largest, GENTLE))
        verdict = below(largest, GENTLE)
        return Finding(verdict, largest.value, largest.low, largest.high, seeds_at_each(found), told, largest.p)

    return Rule(
        kind="the cost grows gently",
        statistic=f"largest loss, from one fraction to the next, of the {KEPT}",
        words=f"over at least {FEWEST_LEVELS} fractions, supported if the 95 % Welch interval of every loss is below "
        f"{GENTLE:g}, contradicted if that of one loss, widened for their number, is above {GENTLE:g}",
        needs=(needs, MEASURE),
        judge=judge,
        measure=_measure(task, method, fractions),
    )


def portion_solved(task: str, method: str, fraction: float, needs: str) -> Rule:
    """Return the rule for "with the large cutout `fraction`, a significant portion of unseen instances is solved"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # nothing is drawn
        variant = Variant.of(cutout=fraction)
        rows = evidence.instances(task, method, variant)
        if "in_cutout" not in rows.columns or not (rows["in_cutout"] > 0).any():
            raise InsufficientData(f"no instances in the cutout of {task}/{method}/{variant.name}")
        unseen = rows[rows["in_cutout"] > 0].groupby("seed")["success"]
        rates, count = unseen.mean().to_numpy(), int(unseen.size().min())
        found = stats.one_sample_t(rates, SIGNIFICANT)
        n, told = f"{seeds_of(rates)}, {count} instances", reason(found, SIGNIFICANT)
        return Finding(above(found, SIGNIFICANT), found.value, found.low, found.high, n, told, found.p)

    return Rule(
        kind="a quarter of the cutout solved",
        statistic="success rate on the evaluation instances in the cutout region",
        words=f"supported if {T_INTERVAL} is above {SIGNIFICANT:g}, contradicted if below {SIGNIFICANT:g}",
        needs=(needs,),
        judge=judge,
    )


def outside_solved(task: str, method: str, needs: str) -> Rule:
    """Return the rule for "policies solve instances outside the training region"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # nothing is drawn
        frame = evidence.outside
        rows = frame[(frame["task"] == task) & (frame["method"] == method)] if len(frame) else frame
        rates = rows.groupby("seed")["success"].mean().to_numpy() if len(rows) else np.empty(0)
        if len(rates) < MIN_SEEDS:
            raise InsufficientData(
                f"{len(rates)} seeds of {task}/{method} measured outside the region; {MIN_SEEDS} are needed"
            )
        found = stats.one_sample_t(rates, OUTSIDE_SOLVED)
        n, told = f"{seeds_of(rates)}, {rows['instance'].nunique()} instances", reason(found, OUTSIDE_SOLVED)
        return Finding(above(found, OUTSIDE_SOLVED), found.value, found.low, found.high, n, told, found.p)

    return Rule(
        kind="half solved outside the region",
        statistic=f"success rate on instances up to {RIM:.0%} of the region's extent outside of it",
        words=f"supported if {T_INTERVAL} is above {OUTSIDE_SOLVED:g}, contradicted if below {OUTSIDE_SOLVED:g}",
        needs=(needs, MEASURE),
        judge=judge,
        measure=lambda results, log: load_or_measure(results, [(task, method)], log, measure_missing=True),
    )


def kept(evidence: Evidence, task: str, method: str, fraction: float) -> np.ndarray:
    """Return (N,): each seed's mean return on an unseen region, divided by that of the same seed trained on it.

    Both are played on the same instances.

    Raises:
        InsufficientData: there are too few seeds of both or too few instances, or no learned behaviour to compare with.
    """
    rows = evidence.cutout_regions
    if len(rows):
        rows = rows[(rows["task"] == task) & (rows["method"] == method) & np.isclose(rows["region"], fraction)]
    unseen, seen = (_returns(rows, cutout) for cutout in (fraction, 0.0))
    both = pd.concat({"unseen": unseen, "seen": seen}, axis=1, join="inner")
    if len(both) < MIN_SEEDS:
        told = f"{len(both)} seeds of {task}/{method} played on the region {fraction:g} with and without the cutout"
        raise InsufficientData(f"{told}; {MIN_SEEDS} are needed")
    instances = int(rows.groupby(["cutout", "seed"])["instance"].nunique().min())
    if instances < INSTANCES:
        raise InsufficientData(f"{instances} instances in the region {fraction:g} of {task}; {INSTANCES} are needed")
    if (both["seen"] <= 0.0).any():
        lowest = both["seen"].min()
        raise InsufficientData(f"no learned behaviour to compare with: return {lowest:.2f} without the cutout")
    return (both["unseen"] / both["seen"]).to_numpy()


def _returns(rows: pd.DataFrame, cutout: float) -> pd.Series:
    """Return the mean return by seed of policies trained without a fraction of the region."""
    if not len(rows):
        return pd.Series(dtype=np.float64)
    return rows[np.isclose(rows["cutout"], cutout)].groupby("seed")["return"].mean()


def _loss(before: np.ndarray, after: np.ndarray, confidence: float = stats.CONFIDENCE) -> stats.Estimate:
    """Return how much smaller the second mean is, its p-value against `GENTLE`."""
    found = stats.welch(before, after, confidence=confidence)
    return stats.Estimate(found.value, found.low, found.high, stats.welch(before - GENTLE, after).p)


def _with_instances(shares: np.ndarray) -> str:
    return f"{seeds_of(shares)}, {INSTANCES} instances"


def _measure(task: str, method: str, fractions: Sequence[float]) -> partial[None]:
    def measure(results: Path, log: Log) -> None:
        measure_cutout_regions(results, task, method, fractions, log)

    return partial(measure)
