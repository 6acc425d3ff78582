"""Particle swarm optimisation (Kennedy and Eberhart 1995) of a cheap function over [-1, 1]^X.

Shapes: `P` particles, `X` parameters.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from codesign_bench.config.validation import check_values
from codesign_bench.config.values import Within
from codesign_bench.task import Floats

Fitness = Callable[[Floats], Floats]
"""Maps positions (P, X) to their values (P,)."""


@dataclass(frozen=True, kw_only=True)
class SwarmConfig:
    """Hyperparameters of the swarm. The three weights are those of Luck et al. 2019 (code)."""

    swarm_size: Annotated[int, Within(1, 100_000)] = 60
    """Particles."""
    swarm_iterations: Annotated[int, Within(0, 100_000)] = 100
    """Moves of every particle."""
    swarm_inertia: Annotated[float, Within(0.0, 1.0)] = 0.9
    """Share of its velocity that a particle keeps."""
    swarm_own_pull: Annotated[float, Within(0.0, 4.0)] = 0.5
    """Largest pull towards the best place that the particle has seen."""
    swarm_best_pull: Annotated[float, Within(0.0, 4.0)] = 0.3
    """Largest pull towards the best place that any particle has seen."""

    def __post_init__(self) -> None:
        check_values(self)


@dataclass(frozen=True)
class Found:
    """The best place that a swarm has seen."""

    position: Floats
    """(X,) in [-1, 1]."""
    value: float


def maximize(fitness: Fitness, size: int, config: SwarmConfig, rng: np.random.Generator) -> Found:
    """Return the best place that a swarm sees; `size` is X."""
    position, velocity = rng.uniform(-1.0, 1.0, (2, config.swarm_size, size))
    own, own_value = position, fitness(position)
    for _ in range(config.swarm_iterations):
        to_own, to_best = rng.random((2, *position.shape))
        velocity = (
            config.swarm_inertia * velocity
            + config.swarm_own_pull * to_own * (own - position)
            + config.swarm_best_pull * to_best * (own[own_value.argmax()] - position)
        )
        free = position + velocity
        position = np.clip(free, -1.0, 1.0)
        velocity = np.where(position == free, velocity, 0.0)  # a particle stops at a bound, and is pulled back
        value = fitness(position)
        better = value > own_value
        own, own_value = np.where(better[:, None], position, own), np.where(better, value, own_value)
    return Found(own[own_value.argmax()], float(own_value.max()))
