"""Shared by several kinds of rules.

Shapes: `N` seeds, `R` resamples, `F` fractions or coefficients.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.stats import rankdata

from codesign_bench import stats
from codesign_bench.cell.variant import DEFAULT, Variant
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import InsufficientData

OVER_SEEDS = "the 95 % bootstrap interval over seeds"
BUDGET_TOLERANCE = 0.1
"""Budgets count as equal up to this relative difference in environment steps, since batches overshoot slightly."""
FEWEST_LEVELS = 3
"""Fewest fractions or coefficients for a trend."""

Statistic = Callable[..., np.ndarray]
"""Takes resampled samples (R, N, ...) and returns (R,)."""


def run_command(method: str, task: str, seeds: int, more: str = "") -> str:
    """Return the command that runs cells, with the placeholders of `Rule.needs`.

    Finished cells are skipped, so claims about one task may share a command with `method` "all".
    """
    return f"codesign-bench run --method {method} --task {task}{more} --seeds {seeds}{{profile}} --out {{results}}"


def estimate(
    samples: Sequence[np.ndarray], statistic: Statistic, rng: np.random.Generator
) -> tuple[float, float, float]:
    """Return a statistic of samples (N, ...) and the ends of its bootstrap interval over seeds."""
    low, high = stats.bootstrap(samples, statistic, rng)
    return float(statistic(*(sample[None] for sample in samples))[0]), float(low), float(high)


def mean(sample: np.ndarray) -> np.ndarray:
    """Return the means (R,) of samples (R, N)."""
    return np.asarray(sample.mean(axis=1))


def difference(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the differences (R,) of the means of two samples (R, N)."""
    return mean(first) - mean(second)


def trend(levels: Sequence[float]) -> Statistic:
    """Return Spearman's rank correlation of F levels with the means of F samples, as a function of the samples.

    It is 0 if all means are equal.
    """

    def correlation(*samples: np.ndarray) -> np.ndarray:
        # Pearson's correlation of ranks, for all resamples at once. Ranks instead of values, since a claim about a
        # trend is about its direction, and one extreme seed must not decide it.
        ranks = rankdata([mean(sample) for sample in samples], axis=0)  # (F, R)
        ranks = ranks - ranks.mean(axis=0)
        order = rankdata(levels) - rankdata(levels).mean()
        scale = np.sqrt((order**2).sum() * (ranks**2).sum(axis=0))
        return np.divide(order @ ranks, scale, out=np.zeros_like(scale), where=scale > 0.0)

    return correlation


def at_each(levels: Sequence[float], read: Callable[[float], np.ndarray]) -> dict[float, np.ndarray]:
    """Return `read(level)` for each level in ascending order, without levels that have no data.

    Raises:
        InsufficientData: fewer than `FEWEST_LEVELS` levels have data.
    """
    found, reasons = {}, []
    for level in sorted(levels):
        try:
            found[level] = read(level)
        except InsufficientData as error:
            reasons.append(str(error))
    if len(found) < FEWEST_LEVELS:
        raise InsufficientData(reasons[0])
    return found


def check_budgets(evidence: Evidence, task: str, *sides: tuple[str, Variant]) -> None:
    """Check that all sides, each (method, variant), were trained for the same number of environment steps.

    Raises:
        InsufficientData: they were not, or cells of a side are missing.
    """
    budgets = [evidence.budget(task, method, variant) for method, variant in sides]
    if max(budgets) > (1.0 + BUDGET_TOLERANCE) * min(budgets):
        told = " and ".join(f"{budget:,.0f}" for budget in budgets)
        raise InsufficientData(f"budgets differ on {task}: {told} environment steps")


def check_methods(evidence: Evidence, task: str, *methods: str) -> None:
    """Check the budgets of methods' default cells.

    Raises:
        InsufficientData: as `check_budgets` does.
    """
    check_budgets(evidence, task, *((method, DEFAULT) for method in methods))


def seeds_of(*samples: np.ndarray) -> str:
    """Return the numbers of seeds as text."""
    return " and ".join(str(len(sample)) for sample in samples) + " seeds"


def seeds_at_each(found: dict[float, np.ndarray]) -> str:
    """Return the levels and their numbers of seeds as text."""
    counts = sorted({len(sample) for sample in found.values()})
    seeds = "-".join(str(count) for count in dict.fromkeys((counts[0], counts[-1])))
    return f"{seeds} seeds at each of {', '.join(f'{level:g}' for level in found)}"
