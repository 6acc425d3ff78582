"""Rules that compare two variants of the same methods across tasks.

Shapes: `N` seeds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from codesign_bench import stats
from codesign_bench.cell.variant import Variant
from codesign_bench.claims.claim import Rule
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import Finding, above, joined, reason
from codesign_bench.claims.statistics import EFFECT_SCALE, LEAST_SHARE, check_budgets, effect_scale

ACROSS_INTERVAL = "the 95 % Welch-Satterthwaite interval over tasks and seeds"
SHARE = f"as a share of {EFFECT_SCALE}"


@dataclass(frozen=True)
class Contrast:
    """Two variants of some methods, which are compared on some tasks."""

    tasks: Sequence[str]
    first: Variant
    """The variant that the claim says is better."""
    second: Variant
    needs: tuple[str, ...]
    """Commands that produce the cells, as `Rule.needs`."""

    def pairs(self, evidence: Evidence, method: str) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return, per task, the final returns (N,) of both variants of a method as shares of the task's scale.

        Raises:
            InsufficientData: cells are missing, budgets differ, or a task has no scale.
        """
        found = []
        for task in self.tasks:
            sides = ((method, self.first), (method, self.second))
            check_budgets(evidence, task, *sides)
            scale = effect_scale(evidence, task, *sides)
            first, second = (evidence.final_returns(task, *side) / scale for side in sides)
            found.append((first, second))
        return found


def variant_ahead(contrast: Contrast, methods: Sequence[str]) -> Rule:
    """Return the rule for "across tasks and `methods`, the first variant ends above the second"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        pairs = [pair for method in methods for pair in contrast.pairs(evidence, method)]
        found = stats.welch_across(pairs)
        told = joined(
            f"above in {stats.probability_of_improvement(pairs):.0%} of pairs of seeds",
            reason(found, least=LEAST_SHARE),
        )
        verdict = above(found, least=LEAST_SHARE)
        return Finding(
            verdict,
            found.value,
            found.low,
            found.high,
            _counted(pairs, len(methods)),
            told,
            stats.stratified_p(pairs, rng),
        )

    return Rule(
        kind="variant ahead across tasks",
        statistic=f"difference of mean final returns, {SHARE}, averaged over tasks and methods",
        words=f"supported if {ACROSS_INTERVAL} is above 0 and the difference is at least {LEAST_SHARE:g}, contradicted "
        "if the same holds below 0; p from permutations within each task and method",
        needs=contrast.needs,
        judge=judge,
    )


def variant_helps_more(contrast: Contrast, method: str, other: str) -> Rule:
    """Return the rule for "the first variant is worth more to `method` than to `other`"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        del rng  # nothing is drawn
        ours, theirs = (contrast.pairs(evidence, name) for name in (method, other))
        # What `method` gains minus what `other` gains is a sum of two differences, the second with its sides swapped.
        pairs = [*ours, *((second, first) for first, second in theirs)]
        half = stats.welch_across(pairs)
        found = stats.Estimate(2.0 * half.value, 2.0 * half.low, 2.0 * half.high, half.p)
        gains = [np.mean([first.mean() - second.mean() for first, second in side]) for side in (ours, theirs)]
        told = joined(f"gains {gains[0]:+.2f} and {gains[1]:+.2f}", reason(found, least=LEAST_SHARE))
        verdict = above(found, least=LEAST_SHARE)
        return Finding(verdict, found.value, found.low, found.high, _counted(pairs, 2), told, found.p)

    return Rule(
        kind="variant helps one method more",
        statistic=f"difference of two gains; a gain is the difference of mean final returns of two variants, {SHARE}, "
        "averaged over tasks",
        words=f"supported if {ACROSS_INTERVAL} is above 0 and the difference is at least {LEAST_SHARE:g}, contradicted "
        "if the same holds below 0",
        needs=contrast.needs,
        judge=judge,
    )


def _counted(pairs: Sequence[tuple[np.ndarray, np.ndarray]], methods: int) -> str:
    """Return the numbers of tasks, methods and seeds as text."""
    counts = [len(sample) for pair in pairs for sample in pair]
    seeds = "-".join(str(count) for count in dict.fromkeys((min(counts), max(counts))))
    return f"{len(pairs) // methods} tasks, {methods} method{'s' if methods > 1 else ''}, {seeds} seeds"
