"""How often intervals hold the true value, simulated: `python tests/interval_coverage.py` fills docs/statistics.md.

Shapes: `N` seeds.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.stats import norm, trim_mean

from codesign_bench import stats
from codesign_bench.text_tables import markdown

PAGE = Path(__file__).resolve().parent.parent / "docs" / "statistics.md"
TABLE = re.compile(r"(<!-- coverage -->\n).*?(<!-- end -->)", re.DOTALL)
SIMULATED = 2000
"""Data sets behind each number of the page."""
SEEDS = (3, 6, 10)
FAILED = 0.3
"""Share of failed seeds of the bimodal distribution."""
NEAR_ONE, SPREAD = 0.99, 0.02
"""Of the distribution at a ceiling, before what is above 1 becomes 1."""
TASKS = (0.0, 0.5, 1.0)
"""Offsets of the tasks over which an interquartile mean is taken."""

Draw = Callable[[np.random.Generator, int], np.ndarray]
Interval = tuple[float, float]


def normal(rng: np.random.Generator, n: int) -> np.ndarray:
    """Return (N,) scores that scatter normally."""
    return rng.normal(size=n)


def bimodal(rng: np.random.Generator, n: int) -> np.ndarray:
    """Return (N,) scores around 1, or around 0 where a seed failed."""
    return (rng.random(n) >= FAILED) + rng.normal(scale=0.05, size=n)


def ceiling(rng: np.random.Generator, n: int) -> np.ndarray:
    """Return (N,) success rates of which many are 1."""
    return np.minimum(rng.normal(NEAR_ONE, SPREAD, size=n), 1.0)


_GAP = (1.0 - NEAR_ONE) / SPREAD
DRAWS: dict[str, tuple[Draw, float]] = {
    "normal": (normal, 0.0),
    "bimodal": (bimodal, 1.0 - FAILED),
    # 1 less the mean of what a normal variable lacks to 1.
    "ceiling": (ceiling, 1.0 - (1.0 - NEAR_ONE) * float(norm.cdf(_GAP)) - SPREAD * float(norm.pdf(_GAP))),
}
"""Distribution -> how to draw seeds, and their true mean."""


def of_mean(draw: Draw, n: int, rng: np.random.Generator) -> Interval:
    """Return the t interval of the mean of one method."""
    return stats.mean_t_interval(draw(rng, n))


def of_difference(draw: Draw, n: int, rng: np.random.Generator) -> Interval:
    """Return Welch's interval of the difference of two methods."""
    found = stats.welch(draw(rng, n), draw(rng, n))
    return found.low, found.high


def across_tasks(draw: Draw, n: int, rng: np.random.Generator) -> Interval:
    """Return the interval of a mean difference over three tasks."""
    found = stats.welch_across([(draw(rng, n), draw(rng, n)) for _ in TASKS])
    return found.low, found.high


def of_share(draw: Draw, n: int, rng: np.random.Generator) -> Interval:
    """Return the exact interval of the share of seeds that do not fail."""
    wins = int((bimodal(rng, n) > 0.5).sum())
    return stats.proportion_interval(wins, n)


def of_interquartile_mean(draw: Draw, n: int, rng: np.random.Generator) -> Interval:
    """Return the bootstrap interval of the interquartile mean over three tasks and their seeds."""
    samples = [draw(rng, n) + offset for offset in TASKS]
    low, high = stats.bootstrap(
        samples, lambda *parts: trim_mean(np.concatenate(parts, axis=1), 0.25, axis=1), rng, resamples=400
    )
    return float(low), float(high)


def true_interquartile_mean(draw: Draw) -> float:
    """Return the interquartile mean over tasks of endlessly many seeds."""
    rng = np.random.default_rng(0)
    return float(trim_mean(np.concatenate([draw(rng, 300_000) + offset for offset in TASKS]), 0.25))


ROWS: list[tuple[str, str, Callable[[Draw, int, np.random.Generator], Interval]]] = [
    *(("mean of one method, t", name, of_mean) for name in DRAWS),
    *(("difference of two methods, Welch", name, of_difference) for name in DRAWS),
    *(("difference over three tasks, Welch-Satterthwaite", name, across_tasks) for name in DRAWS),
    ("share of seeds, exact", "30 % fail", of_share),
    *(("interquartile mean over three tasks, bootstrap", name, of_interquartile_mean) for name in DRAWS),
]
"""Kind of interval, distribution, and how to make one."""


def truth(kind: Callable[..., Interval], name: str) -> float:
    """Return what the interval is to hold."""
    if kind is of_share:
        return 1.0 - FAILED
    draw, mean = DRAWS[name]
    if kind is of_interquartile_mean:
        return true_interquartile_mean(draw)
    return mean if kind is of_mean else 0.0


def coverage(row: int, n: int, simulated: int, seed: int) -> tuple[float, float]:
    """Return the share of intervals that hold the truth, and the share of data sets that give no interval."""
    _, name, kind = ROWS[row]
    draw = DRAWS[name][0] if name in DRAWS else bimodal
    rng, target = np.random.default_rng([seed, row, n]), truth(kind, name)
    ends = np.array([kind(draw, n, rng) for _ in range(simulated)])
    given = ~np.isnan(ends[:, 0])
    held = (ends[given, 0] <= target) & (target <= ends[given, 1])
    return float(held.mean()), float(1.0 - given.mean())


def table() -> str:
    """Return the page's table."""
    lines = []
    for row, (title, name, _) in enumerate(ROWS):
        shares = [f"{coverage(row, n, SIMULATED, seed=0)[0]:.3f}" for n in SEEDS]
        lines.append((title, name, *shares))
        print(*lines[-1], sep=" | ", flush=True)
    return markdown(("interval, 95 %", "seeds are", *(f"n = {n}" for n in SEEDS)), lines)


def read() -> dict[tuple[str, str], list[float]]:
    """Return the numbers of the page by interval and distribution."""
    rows = re.findall(
        r"^\| (.+?) \| (.+?) \| (0\.\d+|1\.0+) \| (0\.\d+|1\.0+) \| (0\.\d+|1\.0+) \|$", PAGE.read_text(), re.M
    )
    return {(title, name): [float(number) for number in numbers] for title, name, *numbers in rows}


if __name__ == "__main__":
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(TABLE.sub(lambda found: f"{found[1]}\n{table()}\n{found[2]}", page), encoding="utf-8")
    sys.exit(0)
