"""Tests that reshuffle labels: they are right for every distribution of scores and for the fewest seeds.

Shapes: `N` and `M` seeds, `L` levels, `P` permutations. If methods do not differ, each way of dealing out the scores to
the methods is equally probable; the p-value is the share of ways in which the statistic is at least as extreme. All
ways are tried if there are at most `MOST` of them; otherwise as many are drawn, and the observed one is counted
among them, so that the test errs on the safe side.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations, product

import numpy as np
from numpy.typing import ArrayLike

from codesign_bench.stats.summaries import finite

MOST = 20_000
"""Up to so many permutations are tried one by one (ours); 8 against 8 seeds have 12,870."""

_ROUNDING = 1e-9
"""Relative tolerance within which two permutations count as equally extreme: sums depend on the order of addition."""


def difference_p(first: ArrayLike, second: ArrayLike, rng: np.random.Generator) -> float:
    """Return the two-sided p-value of equal distributions of (N,) and (M,), by the difference of their means."""
    return stratified_p([(first, second)], rng)


def stratified_p(pairs: Sequence[tuple[ArrayLike, ArrayLike]], rng: np.random.Generator) -> float:
    """Return the two-sided p-value of "on no task do the two methods differ", labels reshuffled within each task.

    The statistic is the sum over tasks of the difference of means, in units of the task's own standard deviation over
    both methods, so that no task outweighs the others by its scale.

    Args:
        pairs: per task, the scores of two methods, (N,) and (M,).
        rng: draws permutations if there are too many to try all.

    Returns:
        The p-value; NaN if a method has no score on some task. A task on which all scores are equal says nothing.
    """
    samples = [(finite(first), finite(second)) for first, second in pairs]
    if not samples or not all(first.size and second.size for first, second in samples):
        return math.nan
    ways = math.prod(math.comb(first.size + second.size, first.size) for first, second in samples)
    sums = []
    for first, second in samples:
        pooled = np.concatenate([first, second])
        spread = pooled.std() or 1.0
        effects = _differences((pooled - pooled.mean()) / spread, first.size, None if ways <= MOST else rng)
        sums.append(effects)
    # All ways: every way of one task goes with every way of the others. The observed one is the first of each.
    totals = np.array([sum(parts) for parts in product(*sums)]) if ways <= MOST else np.sum(sums, axis=0)
    return _share_as_extreme(np.abs(totals))


def _differences(scores: np.ndarray, size: int, rng: np.random.Generator | None) -> np.ndarray:
    """Return (P,) differences of means for ways of calling `size` of the scores the first method's, as given first."""
    count = len(scores)
    if rng is None:
        chosen = np.zeros((math.comb(count, size), count), dtype=bool)
        members = np.array(list(combinations(range(count), size)))
        chosen[np.arange(len(chosen))[:, None], members] = True
    else:
        order = rng.permuted(np.tile(np.arange(count), (MOST, 1)), axis=1)
        order[0] = np.arange(count)
        chosen = order < size
    return np.asarray(
        np.where(chosen, scores, 0.0).sum(axis=1) / size - np.where(chosen, 0.0, scores).sum(axis=1) / (count - size)
    )


def sign_flip_p(differences: ArrayLike, rng: np.random.Generator) -> float:
    """Return the two-sided p-value of "differences (N,) are symmetric around 0", by their mean.

    The signs of paired differences are reshuffled: without an effect each is as probable as its opposite.
    """
    array = finite(differences)
    if not array.size:
        return math.nan
    if 2**array.size <= MOST:
        signs = np.array(list(product((1.0, -1.0), repeat=array.size)))
    else:
        signs = rng.choice((1.0, -1.0), size=(MOST, array.size))
        signs[0] = 1.0
    return _share_as_extreme(np.abs(signs @ array))


def jonckheere_p(samples: Sequence[ArrayLike], rng: np.random.Generator, *, same: float = 0.0) -> tuple[float, float]:
    """Return the direction and the two-sided p-value of a trend over L ordered levels (Jonckheere 1954).

    The statistic counts, over all pairs of levels, the pairs of seeds in which the higher level has the higher score,
    ties counting one half. Scores are reshuffled over levels.

    Args:
        samples: per level, in their order, the scores (N,) of its seeds.
        rng: draws permutations.
        same: scores that differ by no more than this count as equal, so that a trend in the last digit is none.

    Returns:
        The statistic from -1 (every pair falls) to 1 (every pair rises), and the p-value; both NaN for fewer than two
        levels.
    """
    arrays = [finite(sample) for sample in samples]
    if len(arrays) < 2 or not all(array.size for array in arrays):
        return math.nan, math.nan
    level = np.repeat(np.arange(len(arrays)), [array.size for array in arrays])
    scores = np.concatenate(arrays)
    rising = np.sign(level[None, :] - level[:, None])  # 1 if the second of a pair has the higher level
    order = rng.permuted(np.tile(np.arange(len(scores)), (MOST, 1)), axis=1)
    order[0] = np.arange(len(scores))
    apart = scores[None, :] - scores[:, None]
    higher = np.where(np.abs(apart) > same, np.sign(apart), 0.0)
    pairs = np.count_nonzero(rising > 0)
    concordant = _concordance(higher, rising, order) / (2.0 * pairs)
    return float(concordant[0]), _share_as_extreme(np.abs(concordant))


def _concordance(higher: np.ndarray, rising: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Return (P,): the sum of higher * rising over pairs, the scores of `higher` dealt out in each order."""
    found = np.empty(len(order))
    for start in range(0, len(order), 500):  # In blocks: all permutations of 30 seeds at once would fill 140 MB.
        some = order[start : start + 500]
        dealt = higher[some[:, :, None], some[:, None, :]]
        found[start : start + 500] = (dealt * rising).sum(axis=(1, 2))
    return found


def _share_as_extreme(statistic: np.ndarray) -> float:
    """Return the share of the statistics (P,) that are at least as large as the first, the observed one."""
    return float(np.mean(statistic >= statistic[0] - _ROUNDING * max(1.0, float(abs(statistic[0])))))
