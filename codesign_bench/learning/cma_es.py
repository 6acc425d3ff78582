"""CMA-ES by pycma (Hansen), with a state that can be saved without pickle.

Shapes: `P` candidates of a generation, `X` parameters, `K` instances.

The state of pycma is a function of its random numbers and the fitness values. So the saved state is the fitness
history: to resume, the same generations are asked and told again, which gives the same numbers.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isnan, nan
from typing import Annotated, Any

import cma
import numpy as np

from codesign_bench.config.search import Integer, LogUniform
from codesign_bench.config.validation import check_values
from codesign_bench.config.values import Share, Within
from codesign_bench.task import Floats

PYCMA = {"source": "pycma's default"}


@dataclass(frozen=True, kw_only=True)
class EvolutionConfig:
    """Hyperparameters of CMA-ES; the four learning rates are pycma's options of the same meaning."""

    popsize: Annotated[int, Within(2, 10_000)] = field(default=24, metadata={"search": Integer(6, 32, log=True)})
    """Candidates of a generation; pycma needs two."""
    sigma0: Annotated[float, Within(1e-12, 10.0)] = field(default=0.1, metadata={"search": LogUniform(0.05, 0.6)})
    """Initial standard deviation; parameters are in [-1, 1]."""
    center_learning_rate: Share = field(default=1.0, metadata=PYCMA)
    """Learning rate of the mean (pycma's `CMA_cmean`)."""
    covariance_learning_rate: Share = field(default=1.0, metadata=PYCMA)
    """Multiplier of the covariance update (pycma's `CMA_on`)."""
    rank_mu_learning_rate: Share = field(default=1.0, metadata=PYCMA)
    """Multiplier of the rank-mu update (pycma's `CMA_rankmu`)."""
    rank_one_learning_rate: Share = field(default=1.0, metadata=PYCMA)
    """Multiplier of the rank-one update (pycma's `CMA_rankone`)."""

    def __post_init__(self) -> None:
        check_values(self)


class Evolution:
    """Maximises a fitness over [-1, 1]^X, generation by generation, from `start` (X,) or the centre."""

    def __init__(
        self, size: int, config: EvolutionConfig, rng: np.random.Generator, start: Floats | None = None
    ) -> None:
        own = rng.spawn(1)[0]  # a separate generator, so that other draws do not shift the numbers of a replay
        options = {
            "popsize": config.popsize,
            "bounds": [-1.0, 1.0],
            "CMA_cmean": config.center_learning_rate,
            "CMA_on": config.covariance_learning_rate,
            "CMA_rankmu": config.rank_mu_learning_rate,
            "CMA_rankone": config.rank_one_learning_rate,
            # pycma would draw from numpy's global generator; `seed` NaN keeps it from seeding that one.
            "randn": lambda *shape: own.standard_normal(shape),
            "seed": np.nan,
            "verbose": -9,
            "verb_log": 0,
            "verb_disp": 0,
        }
        self._size = size
        # pycma fails in one dimension, so a second number is searched that nothing depends on.
        first = np.zeros(max(2, size))
        first[:size] = 0.0 if start is None else np.clip(start, -1.0, 1.0)
        self._strategy = cma.CMAEvolutionStrategy(first, config.sigma0, options)
        self.sigma0 = config.sigma0
        self._asked: list[Any] | None = None
        self.history: list[list[float]] = []

    def ask(self) -> Floats:
        """Return the candidates (P, X) of the current generation; a second call before `tell` returns the same."""
        if self._asked is None:
            self._asked = self._strategy.ask()
        return np.array(self._asked)[:, : self._size]

    def tell(self, fitness: Floats) -> None:
        """End the generation with the fitness (P,) of its candidates; larger is better."""
        self.ask()
        # pycma minimises, so the fitness changes its sign.
        self._strategy.tell(self._asked, (-fitness).tolist())
        self.history.append(fitness.tolist())
        self._asked = None

    @property
    def mean(self) -> Floats:
        """The mean (X,) of the search distribution, inside the bounds."""
        return np.array(self._strategy.result.xfavorite)[: self._size]

    @property
    def sigma(self) -> float:
        """The overall standard deviation of the search distribution."""
        return float(self._strategy.sigma)

    @property
    def converged(self) -> bool:
        """Whether one of pycma's criteria says that going on is pointless, e.g. that the distribution has shrunk."""
        return bool(self._strategy.stop())

    def metrics(self) -> dict[str, float]:
        """Return what is logged of the search."""
        return {
            "generations": float(len(self.history)),
            "sigma": self.sigma,
            "sigma_fraction": self.sigma / self.sigma0,
            "converged": float(self.converged),
        }

    def replay(self, history: Floats) -> None:
        """Repeat generations with the stored fitness (generations, P), on a new object with the same generator."""
        for fitness in history:
            self.tell(fitness)


def reliability(returns: Floats) -> float:
    """Return how much of the variance of candidates' mean returns is due to the candidates, from 0 to 1.

    It is the intraclass correlation ICC(3, k) of Shrout and Fleiss (1979): candidates are rated by the same K
    instances, whose own difficulty shifts all candidates alike and does not count as noise.

    Args:
        returns: (P, K) of P candidates on the same K instances.

    Returns:
        The share; NaN where there is one instance or one candidate, or where all candidates' means are equal.
    """
    count, instances = returns.shape
    if count < 2 or instances < 2:
        return nan
    means = returns.mean(axis=1)
    residual = returns - means[:, None] - returns.mean(axis=0) + returns.mean()
    between = instances * means.var(ddof=1)
    within = (residual**2).sum() / ((count - 1) * (instances - 1))
    return max(0.0, float(1.0 - within / between)) if between > 0.0 else nan


def fitness_metrics(returns: Floats) -> dict[str, float]:
    """Return what is logged of the returns (P, K) that a generation's fitness is the mean of.

    The reliability is left out where there is none.
    """
    share = reliability(returns)
    known = {} if isnan(share) else {"fitness_reliability": share}
    return {"fitness_instances": float(returns.shape[1]), **known}
