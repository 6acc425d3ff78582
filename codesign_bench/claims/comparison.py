"""Rules that compare methods by final return and by sample efficiency.

Shapes: `N` and `M` seeds.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from codesign_bench import stats
from codesign_bench.claims.claim import Rule
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import CEILING, UNDECIDED, Finding, above, below, joined, reason
from codesign_bench.claims.statistics import (
    EFFECT_SCALE,
    LEAST_SHARE,
    WELCH_INTERVAL,
    check_methods,
    effect_scale,
    seeds_of,
)

ALMOST_ALL = 0.95
"""Mean success above which a task leaves a method no room (ours)."""
MOST_OF_THE_WAY = 0.9
"""Share of the way to a final return at which it counts as reached: the last tenth is slow and noisy (ours)."""
LEAST_BUDGET = 0.05
"""Share of the budget that a method must save: about the distance of two evaluations (ours)."""


def final_return_above(task: str, method: str, baseline: str, needs: tuple[str, ...]) -> Rule:
    """Return the rule for "`method` ends with a higher return than `baseline` on `task`"; see `Rule.needs`."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # nothing is drawn
        check_methods(evidence, task, method, baseline)
        first, second = evidence.final_returns(task, method), evidence.final_returns(task, baseline)
        least = LEAST_SHARE * effect_scale(evidence, task)
        found, n = stats.welch(first, second), seeds_of(first, second)
        note = f"above in {stats.probability_of_improvement([(first, second)]):.0%} of pairs of seeds"
        if _at_ceiling(evidence, task, method, baseline):
            return Finding(CEILING, found.value, found.low, found.high, n, joined(note, TOO_EASY), found.p)
        verdict = above(found, least=least)
        same = verdict == UNDECIDED and stats.equivalent(first, second, least)
        if verdict == UNDECIDED:
            note = joined(note, reason(found, least=least), f"equivalent within {least:.2g}" if same else "")
        return Finding(verdict, found.value, found.low, found.high, n, note, found.p, equivalent=same)

    return Rule(
        kind="final return above",
        statistic="difference of mean final returns",
        words=f"supported if {WELCH_INTERVAL} is above 0 and the difference is at least {LEAST_SHARE:.0%} of "
        f"{EFFECT_SCALE}, contradicted if the same holds below 0; ceiling if both methods' mean "
        f"success is above {ALMOST_ALL:g}",
        needs=needs,
        judge=judge,
    )


TOO_EASY = f"both succeed in more than {ALMOST_ALL:.0%}"


def _at_ceiling(evidence: Evidence, task: str, *methods: str) -> bool:
    return all(evidence.final_successes(task, method).mean() > ALMOST_ALL for method in methods)


def sooner(task: str, method: str, baseline: str, needs: tuple[str, ...]) -> Rule:
    """Return the rule for "`method` needs fewer environment steps on `task` than `baseline`"; see `Rule.needs`."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # nothing is drawn
        check_methods(evidence, task, method, baseline)
        curves = [evidence.curve(task, name) for name in (method, baseline)]
        starts, ends = (
            float(np.mean([_starts(rows).mean() for rows in curves])),
            _lesser_end(evidence, task, method, baseline),
        )
        if ends <= starts:
            note = f"the lesser final return, {ends:.2f}, is no higher than the start, {starts:.2f}"
            return Finding(UNDECIDED, float("nan"), note=note)
        target = starts + MOST_OF_THE_WAY * (ends - starts)
        first, second = (shares_of_budget(rows, target) for rows in curves)
        found = stats.welch(first, second)
        area = stats.welch(*(means_along(rows) for rows in curves))
        note = joined(
            f"{first.mean():.2f} against {second.mean():.2f} of the budget",
            f"mean along the curve {area.value:+.2f} [{area.low:.2f}, {area.high:.2f}]",
            reason(found, least=LEAST_BUDGET),
        )
        verdict = below(found, least=LEAST_BUDGET)
        return Finding(verdict, found.value, found.low, found.high, seeds_of(first, second), note, found.p)

    return Rule(
        kind="most of the way sooner",
        statistic=f"difference of the shares of the budget until curves, made monotone, are {MOST_OF_THE_WAY:.0%} of "
        "the way from the start to the lesser of the two mean final returns; never is the whole budget",
        words=f"supported if {WELCH_INTERVAL} is below 0 and at least {LEAST_BUDGET:.0%} of the budget is saved, "
        "contradicted if the same holds above 0",
        needs=needs,
        judge=judge,
    )


def _starts(rows: pd.DataFrame) -> pd.Series:
    """Return each seed's return before training."""
    return rows.sort_values("env_steps").groupby("seed")["return_mean"].first()


def _lesser_end(evidence: Evidence, task: str, *methods: str) -> float:
    return min(float(evidence.final_returns(task, method).mean()) for method in methods)


def shares_of_budget(rows: pd.DataFrame, target: float) -> np.ndarray:
    """Return (N,): the share of its steps after which each seed's curve reaches `target`; 1 if it never does."""
    shares = []
    for _, curve in rows.sort_values("env_steps").groupby("seed"):
        steps = curve["env_steps"].to_numpy(dtype=np.float64)
        reached = stats.steps_to_reach(steps, curve["return_mean"], target)
        shares.append(min(reached / steps[-1], 1.0) if steps[-1] > 0.0 else 1.0)
    return np.array(shares)


def means_along(rows: pd.DataFrame) -> np.ndarray:
    """Return (N,): each seed's return averaged along its curve, which is straight between evaluations."""
    curves = (curve for _, curve in rows.sort_values("env_steps").groupby("seed"))
    return np.array([stats.mean_along(curve["env_steps"], curve["return_mean"]) for curve in curves])


def ahead_across_tasks(tasks: Sequence[str], method: str, baseline: str, needs: tuple[str, ...]) -> Rule:
    """Return the rule for "`method` ends above `baseline` across `tasks`"; see `Rule.needs`."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        pairs = []
        for task in tasks:
            check_methods(evidence, task, method, baseline)
            scale = effect_scale(evidence, task)
            first, second = (evidence.final_returns(task, name) / scale for name in (method, baseline))
            pairs.append((first, second))
        found = stats.welch_across(pairs)
        p = stats.stratified_p(pairs, rng)
        middles = [stats.interquartile_mean(np.concatenate(side)) for side in zip(*pairs, strict=True)]
        note = joined(
            f"above in {stats.probability_of_improvement(pairs):.0%} of pairs of seeds",
            f"interquartile means {middles[0]:.2f} and {middles[1]:.2f}",
            reason(found, least=LEAST_SHARE),
        )
        counts = [len(sample) for pair in pairs for sample in pair]
        n = f"{len(tasks)} tasks, {min(counts)}-{max(counts)} seeds"
        return Finding(above(found, least=LEAST_SHARE), found.value, found.low, found.high, n, note, p)

    return Rule(
        kind="ahead across tasks",
        statistic=f"difference of mean final returns, as a share of {EFFECT_SCALE}, averaged over tasks",
        words="supported if the 95 % Welch-Satterthwaite interval over tasks and seeds is above 0 and the difference "
        f"is at least {LEAST_SHARE:g}, contradicted if the same holds below 0; p from permutations within tasks",
        needs=needs,
        judge=judge,
    )
