"""What depends on the goal, as polynomials that a page can evaluate: first observations and scenes at the start.

A task computes these in Python. Along axes with a list of values there is one polynomial per combination; along the
others, Chebyshev polynomials through Chebyshev nodes. They are exact for constants and linear functions and converge
fast for smooth ones, such as distances. Whether they hold is measured at goals between the nodes.

Coefficients have single precision, like observations.

Shapes: `P` points, `X` axes, `F` features, `L` combinations of listed values, `T` terms.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from codesign_bench.seeding import generator
from codesign_bench.task import EVALUATION_SEED, Floats

from .goals import Goals

NODES = {0: 1, 1: 16, 2: 16, 3: 7}
"""Number of smooth axes -> nodes along each; of more axes, `NODES_OF_MANY`."""
NODES_OF_MANY = 4
NEGLIGIBLE = 1e-7
"""Coefficients below this share of their feature's size are rounding errors of single precision."""
CHECKS = 48
"""Number of goals at which a fit is checked."""

Features = Callable[[Floats], Floats]
"""Maps points (P, X) to features (P, F)."""


@dataclass(frozen=True)
class GoalFunction:
    """Polynomials in the smooth axes, one set per combination of the listed axes' values."""

    goals: Goals
    exponents: tuple[tuple[int, ...], ...]
    """(T, smooth axes) degrees of the Chebyshev polynomials whose product is a term."""
    coefficients: Floats
    """(L, T, F)."""
    errors: Floats
    """(F,) largest error of each feature at goals between the nodes, relative to the feature's size or to 1."""

    @property
    def error(self) -> float:
        """The largest of the features' errors."""
        return float(self.errors.max(initial=0.0))

    def part(self, features: list[int]) -> GoalFunction:
        """Return the function with only some of its features, and the terms that these need."""
        coefficients = self.coefficients[:, :, features]
        kept = [term for term in range(len(self.exponents)) if coefficients[:, term].any()] or [0]
        exponents = tuple(self.exponents[term] for term in kept)
        return GoalFunction(self.goals, exponents, coefficients[:, kept], self.errors[features])

    def __call__(self, points: Floats) -> Floats:
        """Return the features (P, F) at `points` (P, X)."""
        goals = self.goals
        terms = np.ones((len(points), len(self.exponents)))
        for place, axis in enumerate(goals.smooth):
            low, high = goals.axes[axis].low, goals.axes[axis].high
            angle = np.arccos(np.clip((2.0 * points[:, axis] - low - high) / (high - low), -1.0, 1.0))
            terms *= np.cos(angle[:, None] * [exponent[place] for exponent in self.exponents])
        return np.einsum("pt,ptf->pf", terms, self.coefficients[_combination(goals, points)])


def fit(features: Features, goals: Goals) -> GoalFunction:
    """Return polynomials through `features`, with their error."""
    smooth, combinations = goals.smooth, goals.combinations
    count = NODES.get(len(smooth), NODES_OF_MANY)
    angles = np.pi * (np.arange(count) + 0.5) / count
    degrees = tuple(product(range(count), repeat=len(smooth)))
    nodes = np.array(list(product(range(count), repeat=len(smooth))), dtype=int).reshape(count ** len(smooth), -1).T
    points = np.zeros((len(combinations), nodes.shape[1], len(goals.axes)))
    for place, axis in enumerate(smooth):
        low, high = goals.axes[axis].low, goals.axes[axis].high
        points[:, :, axis] = 0.5 * (low + high) + 0.5 * (high - low) * np.cos(angles[nodes[place]])
    points[:, :, goals.listed] = np.array(combinations)[:, None]
    values = features(points.reshape(-1, len(goals.axes))).reshape(*points.shape[:2], -1)
    # Discrete orthogonality: the coefficient of T_k is 2 / n (1 / n for k = 0) times the sum of f T_k over the nodes.
    basis = np.ones((len(degrees), nodes.shape[1]))
    for place in range(len(smooth)):
        degree = np.array([exponent[place] for exponent in degrees])
        basis *= np.where(degree > 0, 2.0, 1.0)[:, None] / count * np.cos(degree[:, None] * angles[nodes[place]])
    coefficients = np.einsum("tn,lnf->ltf", basis, values)
    size = np.maximum(1.0, np.abs(values).max(axis=(0, 1)))
    coefficients[np.abs(coefficients) < NEGLIGIBLE * size] = 0.0
    kept = np.flatnonzero(np.abs(coefficients).max(axis=(0, 2)) > 0.0)
    kept = kept if kept.size else np.array([0])
    single = coefficients[:, kept].astype(np.float32).astype(np.float64)  # as a page gets them
    found = GoalFunction(goals, tuple(degrees[term] for term in kept), single, np.zeros(single.shape[2]))
    checks = goals.random_points(generator(EVALUATION_SEED, "checks of a fit"), CHECKS)
    errors = (np.abs(found(checks) - features(checks)) / size).max(axis=0)
    return GoalFunction(goals, found.exponents, found.coefficients, errors)


def _combination(goals: Goals, points: Floats) -> np.ndarray:
    """Return which combination of listed values each point (P, X) has, (P,)."""
    index = np.zeros(len(points), dtype=int)
    for axis in goals.listed:
        values = np.array(goals.axes[axis].values)
        index = index * len(values) + np.abs(points[:, axis, None] - values).argmin(axis=1)
    return index
