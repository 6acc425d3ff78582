"""Contextual CMA-ES: a search distribution whose mean is a function of the context (Abdolmaleki et al., IJCAI 2017).

Shapes: `n` samples, `c` numbers of a context, `f` features, `D` parameters.

Each sample meets its own context. What tells good samples from bad ones is therefore their advantage, the return minus
what is usual for the context, and the mean is a weighted regression of samples on features of their contexts. In
three points we depart from the paper: the regression is of the difference from the former mean, so that its ridge
penalty holds the mean where it is instead of drawing it to 0; in the rank-mu update every sample is measured from the
mean of its own context; and samples are taken as they act, clipped to [-1, 1].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codesign_bench.task import Box, Floats

RIDGE = 1e-4
"""Penalty of both regressions, per sample; features are of order one (bolero's)."""


class ContextFeatures:
    """Features of a context: 1, its numbers, and the products of those that describe the goal."""

    def __init__(self, state: Box, goal: Box) -> None:
        low, high = np.concatenate([state.low, goal.low]), np.concatenate([state.high, goal.high])
        self._middle, self._half = 0.5 * (low + high), 0.5 * (high - low)
        self._state = state.size
        self._pairs = np.triu_indices(goal.size)
        self.size = 1 + len(low) + len(self._pairs[0])
        """f"""

    def __call__(self, contexts: Floats) -> Floats:
        """Return the features (n, f) of contexts (n, c), state and goal."""
        # By the middle and half the width of their ranges: the ridge penalty then means the same for every number.
        scaled = (contexts - self._middle) / self._half
        goal = scaled[:, self._state :]
        products = goal[:, self._pairs[0]] * goal[:, self._pairs[1]]
        return np.concatenate([np.ones((len(scaled), 1)), scaled, products], axis=1)


@dataclass
class Distribution:
    """The search distribution and what CMA-ES remembers of its path."""

    weights: Floats
    """(f, D) of the mean."""
    sigma: float
    """Overall standard deviation."""
    covariance: Floats
    """(D, D)"""
    path: Floats
    """(D,) of the covariance."""
    sigma_path: Floats
    """(D,)"""
    generations: int = 0

    @classmethod
    def start(cls, features: int, size: int, sigma0: float) -> Distribution:
        """Return the distribution whose mean is the middle for every context."""
        return cls(np.zeros((features, size)), sigma0, np.eye(size), np.zeros(size), np.zeros(size))

    def mean(self, features: Floats) -> Floats:
        """Return the mean (n, D) for features (n, f), inside [-1, 1]."""
        return mean_of(features, self.weights)

    def root(self) -> Floats:
        """Return the lower triangle (D, D) that turns standard-normal noise into deviations from the mean."""
        return np.asarray(self.sigma * np.linalg.cholesky(self.covariance), dtype=np.float64)

    def update(self, features: Floats, samples: Floats, returns: Floats) -> None:
        """Move the distribution towards samples (n, D) of higher returns (n,) than usual for their features (n, f)."""
        count, size = samples.shape
        if count < 2:
            return
        weight = selection_weights(features, returns)
        effective = 1.0 / float((weight**2).sum())
        deviation = (np.clip(samples, -1.0, 1.0) - self.mean(features)) / self.sigma
        change = _ridge(features, deviation, weight)
        step = features.mean(axis=0) @ change  # of the mean at the mean context

        sigma_rate = (effective + 2.0) / (size + effective + 5.0)
        damping = 1.0 + sigma_rate + 2.0 * max(0.0, np.sqrt((effective - 1.0) / (size + 1.0)) - 1.0)
        path_rate = (4.0 + effective / size) / (size + 4.0 + 2.0 * effective / size)
        one_rate = 2.0 / ((size + 1.3) ** 2 + effective)
        mu_rate = min(1.0 - one_rate, 2.0 * (effective - 2.0 + 1.0 / effective) / ((size + 2.0) ** 2 + effective))

        whitened = np.linalg.solve(np.linalg.cholesky(self.covariance), step)
        self.sigma_path *= 1.0 - sigma_rate
        self.sigma_path += np.sqrt(sigma_rate * (2.0 - sigma_rate) * effective) * whitened
        self.generations += 1
        # While the path of sigma is long, the step size is at fault, not the shape: the path of the covariance rests.
        usual = np.sqrt(size) * (1.0 - 1.0 / (4.0 * size) + 1.0 / (21.0 * size**2))
        length = np.linalg.norm(self.sigma_path)
        bias = np.sqrt(1.0 - (1.0 - sigma_rate) ** (2 * self.generations))
        moves = float(length / bias < (1.4 + 2.0 / (size + 1.0)) * usual)
        self.path *= 1.0 - path_rate
        self.path += moves * np.sqrt(path_rate * (2.0 - path_rate) * effective) * step

        self.weights += self.sigma * change
        spread = (deviation * weight[:, None]).T @ deviation
        kept = 1.0 - one_rate - mu_rate + (1.0 - moves) * one_rate * path_rate * (2.0 - path_rate)
        self.covariance = kept * self.covariance + one_rate * np.outer(self.path, self.path) + mu_rate * spread
        self.covariance = 0.5 * (self.covariance + self.covariance.T)
        self.sigma *= float(np.exp(sigma_rate / damping * (length / usual - 1.0)))


def mean_of(features: Floats, weights: Floats) -> Floats:
    """Return the mean (n, D) that weights (f, D) give for features (n, f), inside [-1, 1]."""
    return np.clip(features @ weights, -1.0, 1.0)


def selection_weights(features: Floats, returns: Floats) -> Floats:
    """Return weights (n,) that fall with the logarithm of a sample's rank by advantage; their sum is 1."""
    equal = np.full(len(returns), 1.0 / len(returns))
    usual = returns.mean() + features @ _ridge(features, (returns - returns.mean())[:, None], equal)[:, 0]
    ranks = np.empty(len(returns))
    ranks[np.argsort(-(returns - usual), kind="stable")] = np.arange(1, len(returns) + 1)
    weight = np.log(len(returns) + 0.5) - np.log(ranks)
    return np.asarray(weight / weight.sum())


def _ridge(features: Floats, targets: Floats, weight: Floats) -> Floats:
    """Return the coefficients (f, k) of the weighted ridge regression of targets (n, k) on features (n, f)."""
    weighted = features * weight[:, None]
    penalty = RIDGE * np.eye(features.shape[1])
    return np.asarray(np.linalg.solve(weighted.T @ features + penalty, weighted.T @ targets), dtype=np.float64)
