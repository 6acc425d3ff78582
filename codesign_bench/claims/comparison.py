"""Rules that compare methods by final return and by sample efficiency.

Shapes: `N` seeds, `R` resamples, `T` evaluations along a curve.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from codesign_bench import stats
from codesign_bench.claims.claim import Rule
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import Finding, above, below
from codesign_bench.claims.statistics import (
    OVER_SEEDS,
    check_methods,
    difference,
    estimate,
    mean,
    run_command,
    seeds_of,
)


def higher_final_return(task: str, method: str, baseline: str, seeds: int) -> Rule:
    """Return the rule for "`method` ends with a higher return than `baseline` on `task`"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        check_methods(evidence, task, method, baseline)
        first, second = evidence.final_returns(task, method), evidence.final_returns(task, baseline)
        value, low, high = estimate([first, second], difference, rng)
        note = f"above in {stats.probability_of_improvement([(first, second)]):.0%} of pairs of seeds"
        return Finding(above(low, high, 0.0), value, low, high, seeds_of(first, second), note)

    return Rule(
        kind="higher final return",
        statistic="difference of mean final returns",
        words=f"supported if {OVER_SEEDS} lies above 0, contradicted if below 0",
        needs=(run_command("all", task, seeds),),
        judge=judge,
    )


def fewer_steps(task: str, method: str, baseline: str, seeds: int) -> Rule:
    """Return the rule for "`method` reaches `baseline`'s final return on `task` in fewer environment steps"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        check_methods(evidence, task, method, baseline)
        steps, curves = _on_common_steps(evidence.curve(task, method))
        targets, budget = evidence.final_returns(task, baseline), evidence.budget(task, baseline)

        def share(curves: np.ndarray, targets: np.ndarray) -> np.ndarray:
            return steps_to_reach(steps, mean(curves), mean(targets)) / budget

        value, low, high = estimate([curves, targets], share, rng)
        note = f"{baseline} ends no higher than {method} begins" if value == 0.0 else ""
        return Finding(below(low, high, 1.0), value, low, high, seeds_of(curves, targets), note)

    return Rule(
        kind="fewer steps",
        statistic="steps to the baseline's mean final return, as a share of the baseline's steps",
        words=f"supported if {OVER_SEEDS} lies below 1, contradicted if above 1; never reached is infinitely many",
        needs=(run_command("all", task, seeds),),
        judge=judge,
    )


def steps_to_reach(steps: np.ndarray, curves: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Return (R,): the environment steps (T,) at which curves (R, T) first reach targets (R,); infinity if never.

    Curves are interpolated linearly between evaluations.
    """
    reached = curves >= targets[:, None]
    first = reached.argmax(axis=1)
    # `first` is the evaluation that reached the target; the crossing is between it and the one before. A curve that
    # starts at the target crosses at its first step. argmax is also 0 for a curve that never reaches it, hence the last
    # line.
    row, before = np.arange(len(curves)), np.maximum(first - 1, 0)
    rise = curves[row, first] - curves[row, before]
    missing = targets - curves[row, before]
    share = np.divide(missing, rise, out=np.zeros_like(rise), where=first > before)
    found = steps[before] + share * (steps[first] - steps[before])
    return np.where(reached.any(axis=1), found, np.inf)


def better_across_tasks(tasks: Sequence[str], method: str, baseline: str, seeds: Mapping[str, int]) -> Rule:
    """Return the rule for "`method` ends above `baseline` across `tasks`"."""

    def judge(evidence: Evidence, rng: np.random.Generator) -> Finding:
        for task in tasks:
            check_methods(evidence, task, method, baseline)
        pairs = [(evidence.final_returns(task, method), evidence.final_returns(task, baseline)) for task in tasks]
        low, high = stats.probability_of_improvement_interval(pairs, rng)
        counts = [len(sample) for pair in pairs for sample in pair]
        n = f"{len(tasks)} tasks, {min(counts)}-{max(counts)} seeds"
        return Finding(above(low, high, 0.5), stats.probability_of_improvement(pairs), low, high, n)

    return Rule(
        kind="better across tasks",
        statistic="probability of improvement in final return, averaged over tasks",
        words=f"supported if {OVER_SEEDS}, resampled within tasks, lies above 0.5, contradicted if below 0.5",
        needs=tuple(run_command("all", task, seeds[task]) for task in tasks),
        judge=judge,
    )


def _on_common_steps(rows: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    """Return (T,) environment steps that every seed's curve covers, and (N, T) returns there."""
    grid = stats.on_common_grid(rows, "return_mean").pivot(index="env_steps", columns="seed", values="return_mean")
    common = grid.dropna()
    return common.index.to_numpy(dtype=np.float64), common.to_numpy(dtype=np.float64).T
