"""Bayesian optimisation of a noisy function of a few evaluations, with scikit-learn's Gaussian process.

Shapes: `n` points evaluated so far, `m` other points, `X` parameters, each in [-1, 1].
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import norm, qmc

from codesign_bench.task import Floats

if TYPE_CHECKING:
    from sklearn.gaussian_process import GaussianProcessRegressor

UNIFORM_POINTS = 4_096
"""Points drawn over the whole space, among which the next is chosen."""
LOCAL_POINTS = 1_024
"""Points drawn around the best so far."""
LOCAL_STD = 0.1
"""Standard deviation of these; the space is 2 wide."""


def first_points(count: int, size: int, rng: np.random.Generator) -> Floats:
    """Return a Latin hypercube of `count` points (n, X)."""
    # The engine takes a generator under different names in different versions of scipy; an own one is the same for all.
    seed = int(rng.integers(2**31))
    return 2.0 * qmc.LatinHypercube(size, seed=seed).random(count) - 1.0


def next_point(points: Floats, values: Floats, rng: np.random.Generator) -> Floats:
    """Return the point (X,) of largest expected improvement over `values` (n,) at `points` (n, X); two at least."""
    size = points.shape[1]
    # The process assumes mean 0 and variance 1; expected improvement orders points alike on any scale.
    scaled = (values - values.mean()) / (values.std() or 1.0)
    process = fitted(points, scaled)
    around = points[values.argmax()] + LOCAL_STD * rng.standard_normal((LOCAL_POINTS, size))
    others = np.concatenate([rng.uniform(-1.0, 1.0, (UNIFORM_POINTS, size)), around.clip(-1.0, 1.0)])
    mean, std = predicted(process, others)
    # With noise, the largest value seen is too high a mark: luck decided it. The mark is the largest mean of the
    # process at the points seen (Picheny et al., 2013, call it the plug-in criterion).
    mark = float(predicted(process, points)[0].max())
    chosen: Floats = others[expected_improvement(mean, std, mark).argmax()]
    return chosen


def fitted(points: Floats, values: Floats) -> GaussianProcessRegressor:
    """Return a Gaussian process fitted to `values` (n,), of mean 0 and variance 1, at `points` (n, X).

    Its kernel is Matern's with nu = 5/2 and one length scale for all parameters, for a handful of points cannot tell
    one for each, and a variance for noise. Both are those of the largest marginal likelihood.
    """
    # Imported here: it takes a second, which commands that only list methods need not wait.
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import Matern, WhiteKernel

    kernel = Matern(length_scale=1.0, length_scale_bounds=(0.1, 10.0), nu=2.5) + WhiteKernel(0.1, (1e-4, 1.0))
    process = GaussianProcessRegressor(kernel)
    with warnings.catch_warnings():
        # A length scale or a noise at its bound is a fair answer to few points.
        warnings.simplefilter("ignore", ConvergenceWarning)
        return process.fit(points, values)


def predicted(process: GaussianProcessRegressor, points: Floats) -> tuple[Floats, Floats]:
    """Return mean (m,) and standard deviation (m,) of the function itself, without noise, at `points` (m, X)."""
    mean, std = process.predict(points, return_std=True)
    # scikit-learn counts the kernel's noise term into the variance of a prediction.
    return mean, np.sqrt((std**2 - process.kernel_.k2.noise_level).clip(0.0))


def expected_improvement(mean: Floats, std: Floats, mark: float) -> Floats:
    """Return by how much a normal value with `mean` (m,) and `std` (m,) exceeds `mark`, on average (m,).

    Source: Jones, Schonlau and Welch (1998), equation 15.
    """
    gain = mean - mark
    with np.errstate(divide="ignore", invalid="ignore"):
        scaled = gain / std
        improvement = gain * norm.cdf(scaled) + std * norm.pdf(scaled)
    return np.where(std > 0.0, improvement, gain.clip(0.0))
