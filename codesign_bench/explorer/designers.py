"""Designers as a page can run them: a network, one design, or a grid of designs to interpolate.

Which of them it is follows from the policy alone: a network that torch runs is exported as its operations; a policy
with the same design everywhere is one design; anything else is evaluated on a grid. Each is compared with the policy
itself at random goals before it is used.

Shapes: `P` points, `X` axes, `O` observation, `D` design.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from torch import Tensor

from codesign_bench.learning.network_policy import NetworkPolicy
from codesign_bench.method import Policy
from codesign_bench.seeding import generator
from codesign_bench.task import EVALUATION_SEED, Floats, Singles
from codesign_bench.task.episodes import Episodes, portions
from codesign_bench.task.play import first_observations

from .functions import GoalFunction
from .goals import Goals, product_of
from .programs import Program, UnknownOperation, program_of

ACCURACY = 2e-5
"""Largest difference of a normalised design from the policy's: a fifth of what the page promises."""
BITS = (14, 15, 16, 17, 18, 19, 20, 22, 24)
"""Of a weight; the fewest that are accurate enough are used."""
SAME = 1e-6
"""Normalised designs that differ by no more are one design."""
PROBES = 96
"""Number of goals at which designers are compared."""
PLACES = {1: 41, 2: 25, 3: 9}
"""Number of smooth axes -> places along each of them in a grid of designs; of more axes, `PLACES_OF_MANY`."""
PLACES_OF_MANY = 4


@dataclass(frozen=True)
class NetworkDesigner:
    """A network as operations, with its weights rounded."""

    program: Program
    bits: int
    error: float
    """Largest difference from the policy's normalised designs at the probed goals, as for all designers."""


@dataclass(frozen=True)
class OneDesign:
    """The same normalised design (D,) for every goal."""

    design: Singles
    error: float


@dataclass(frozen=True)
class DesignGrid:
    """Normalised designs on a grid, to be interpolated linearly along the smooth axes."""

    places: list[Floats]
    """Along each axis; of a listed axis, its values."""
    designs: Singles
    """(P, D); the last axis changes fastest."""
    error: float

    def __call__(self, points: Floats) -> Floats:
        """Return the interpolated designs (P, D) at `points` (P, X)."""
        shape = [len(places) for places in self.places]
        corners, weights = [np.zeros(len(points), dtype=int)], [np.ones(len(points))]
        for axis, places in enumerate(self.places):
            at = np.clip(np.interp(points[:, axis], places, np.arange(len(places))), 0, len(places) - 1)
            low = np.minimum(at.astype(int), max(len(places) - 2, 0))
            share = at - low
            high = np.minimum(low + 1, len(places) - 1)
            corners = [index * shape[axis] + end for index in corners for end in (low, high)]
            weights = [weight * part for weight in weights for part in (1.0 - share, share)]
        return np.sum(
            [weight[:, None] * self.designs[index] for weight, index in zip(weights, corners, strict=True)], axis=0
        )


Designer = NetworkDesigner | OneDesign | DesignGrid


def first_look(goals: Goals, points: Floats) -> Singles:
    """Return what a designer observes (P, O) at `points` (P, X)."""
    instances, task = goals.instances(points), goals.task
    parts = [instances[part] for part in portions(len(instances), task)]
    return np.concatenate([first_observations(Episodes(task, len(part)), part) for part in parts])


def designer_of(policy: Policy, goals: Goals, observations: GoalFunction, probes: Floats, seen: Singles) -> Designer:
    """Return the designer of `policy` for a page.

    Args:
        policy: designs in Python.
        goals: all goals of the page.
        observations: the polynomials of the designer's observations.
        probes: (P, X) goals at which both are compared.
        seen: (P, O) the task's own observations there.
    """
    designs = played(policy, seen)
    program = _program(policy, seen.shape[1])
    if program is not None and program.reads:
        inputs = observations(probes).astype(np.float32)
        for bits in BITS:
            rounded = program.rounded(bits)
            error = _difference(np.array([rounded(row) for row in inputs]), designs)
            if error < ACCURACY:
                return NetworkDesigner(rounded, bits, error)
    error = _difference(designs[:1], designs)
    if error <= SAME:
        return OneDesign(designs[0], error)
    count = PLACES.get(len(goals.smooth), PLACES_OF_MANY)
    places = [np.array(axis.values) if axis.values else np.linspace(axis.low, axis.high, count) for axis in goals.axes]
    grid = DesignGrid(places, played(policy, first_look(goals, product_of(places))), 0.0)
    return DesignGrid(places, grid.designs, _difference(grid(probes), designs))


def probes_of(goals: Goals) -> Floats:
    """Return the goals (P, X) at which designers are compared."""
    return goals.random_points(generator(EVALUATION_SEED, "probes of designers"), PROBES)


def played(policy: Policy, observations: Singles) -> Singles:
    """Return the designs (P, D) of `policy` for `observations` (P, O), clipped to [-1, 1] as an episode does."""
    return np.clip(np.asarray(policy.design(observations), dtype=np.float32), -1.0, 1.0)


def _program(policy: Policy, size: int) -> Program | None:
    """Return the operations of a policy's network, or None if it has none, or one with other operations."""
    if not isinstance(policy, NetworkPolicy):
        return None
    designer = policy.designer

    def clipped(observation: Tensor) -> Tensor:
        return designer(observation).clamp(-1.0, 1.0)

    try:
        return program_of(clipped, size)
    except UnknownOperation:
        return None


def _difference(mine: Floats | Singles, theirs: Singles) -> float:
    return float(np.abs(mine - theirs).max(initial=0.0))
