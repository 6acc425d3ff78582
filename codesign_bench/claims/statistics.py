"""What several kinds of rules share.

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
"""Relative difference in environment steps up to which two methods had the same budget; batches overshoot a little."""
FEWEST_LEVELS = 3
"""Fractions or coefficients below which no trend is looked for."""

Statistic = Callable[..., np.ndarray]
"""Takes resampled samples (R, N, ...) and returns (R,)."""


def run_command(method: str, task: str, seeds: int, more: str = "") -> str:
    """Return the command that makes cells, with the places that `Rule.needs` tells.

    Cells that are done are skipped, so claims about one task may share a command, `method` being "all".
    """
    return f"codesign-bench run --method {method} --task {task}{more} --seeds {seeds}{{profile}} --out {{results}}"


def estimate(
    samples: Sequence[np.ndarray], statistic: Statistic, rng: np.random.Generator
) -> tuple[float, float, float]:
    """Return a statistic of samples (N, ...), and the ends of its bootstrap interval over seeds."""
    low, high = stats.bootstrap(samples, statistic, rng)
    return float(statistic(*(sample[None] for sample in samples))[0]), float(low), float(high)


def mean(sample: np.ndarray) -> np.ndarray:
    """Return (R,) means of (R, N)."""
    return np.asarray(sample.mean(axis=1))


def difference(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return (R,) differences of the means of two samples (R, N)."""
    return mean(first) - mean(second)


def trend(levels: Sequence[float]) -> Statistic:
    """Return Spearman's rank correlation of F levels with the means of as many samples, as a function of the samples.

    Where all means are equal it is 0.
    """

    def correlation(*samples: np.ndarray) -> np.ndarray:
        ranks = rankdata([mean(sample) for sample in samples], axis=0)  # (F, R)
        ranks = ranks - ranks.mean(axis=0)
        order = rankdata(levels) - rankdata(levels).mean()
        scale = np.sqrt((order**2).sum() * (ranks**2).sum(axis=0))
        return np.divide(order @ ranks, scale, out=np.zeros_like(scale), where=scale > 0.0)

    return correlation


def at_each(levels: Sequence[float], read: Callable[[float], np.ndarray]) -> dict[float, np.ndarray]:
    """Return what `read` finds at each level in rising order, leaving out levels without data.

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
        InsufficientData: they were not, or a side lacks cells.
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
    """Return the levels found and the numbers of their seeds as text."""
    counts = sorted({len(sample) for sample in found.values()})
    seeds = "-".join(str(count) for count in dict.fromkeys((counts[0], counts[-1])))
    return f"{seeds} seeds at each of {', '.join(f'{level:g}' for level in found)}"
