"""A particle swarm: one force at a time, bounds, and a maximum that is known. Shapes: `P` particles, `X` parameters."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.learning.particle_swarm import Found, SwarmConfig, maximize
from codesign_bench.task import Floats

STILL = {"swarm_inertia": 0.0, "swarm_own_pull": 0.0, "swarm_best_pull": 0.0}
"""No force at all."""


class Watched:
    """A function of positions (P, X) that remembers where it was asked; by default the highest place is far outside."""

    def __init__(self, peak: float = 10.0) -> None:
        self.peak = peak
        self.asked: list[Floats] = []

    def __call__(self, positions: Floats) -> Floats:
        """Return values (P,)."""
        self.asked.append(positions.copy())
        values: Floats = -((positions - self.peak) ** 2).sum(axis=1)
        return values


def search(fitness: Watched, seed: int = 0, **changes: float) -> Found:
    """Return what a swarm of eight finds in three dimensions."""
    config = SwarmConfig(swarm_size=8, **changes)  # type: ignore[arg-type]  # by name
    return maximize(fitness, 3, config, np.random.default_rng(seed))


def test_it_finds_a_maximum_inside() -> None:
    found = search(Watched(0.3), swarm_iterations=200)
    np.testing.assert_allclose(found.position, 0.3, atol=1e-2)
    assert found.value == pytest.approx(-((found.position - 0.3) ** 2).sum())


def test_it_finds_a_maximum_in_a_corner_and_never_asks_outside() -> None:
    fitness = Watched()
    found = search(fitness)
    np.testing.assert_array_equal(found.position, 1.0)
    assert np.abs(fitness.asked).max() == 1.0


def test_without_a_move_it_returns_the_best_of_the_first_places() -> None:
    fitness = Watched(0.3)
    found = search(fitness, swarm_iterations=0)
    (places,) = fitness.asked
    values = -((places - 0.3) ** 2).sum(axis=1)
    np.testing.assert_array_equal(found.position, places[values.argmax()])
    assert found.value == values.max()


def test_inertia_keeps_a_share_of_the_velocity_until_a_bound_stops_it() -> None:
    fitness = Watched()
    search(fitness, swarm_iterations=3, **{**STILL, "swarm_inertia": 0.5})
    steps = np.diff(fitness.asked, axis=0)
    inside = (np.abs(fitness.asked) < 1.0).all(axis=0)
    np.testing.assert_allclose(steps[1:, inside], 0.5 * steps[:-1, inside])
    assert 0 < inside.sum() < inside.size
    stopped = np.abs(fitness.asked[1]) == 1.0
    np.testing.assert_array_equal(fitness.asked[3][stopped], fitness.asked[1][stopped])


def test_particles_are_pulled_towards_the_best_place_at_most_as_far() -> None:
    fitness = Watched(0.3)
    search(fitness, swarm_iterations=1, **{**STILL, "swarm_best_pull": 1.0})
    before, after = fitness.asked
    best = before[(-((before - 0.3) ** 2).sum(axis=1)).argmax()]
    share = (after - before)[before != best] / (best - before)[before != best]
    assert ((share >= 0.0) & (share <= 1.0)).all()
    assert share.std() > 0.1  # a random one for each particle and parameter


def test_a_particle_is_pulled_to_where_it_was_best_itself() -> None:
    """After the first move, which inertia makes, those that got worse turn back and the others stay."""
    fitness = Watched(0.3)
    search(fitness, swarm_iterations=2, **{**STILL, "swarm_inertia": 0.2, "swarm_own_pull": 1.0})
    first, second, third = fitness.asked
    values = [-((places - 0.3) ** 2).sum(axis=1) for places in (first, second)]
    worse = values[1] < values[0]
    assert 0 < worse.sum() < len(worse)
    drift = np.where(np.abs(second) < 1.0, 0.2 * (second - first), 0.0)
    pulled = third - second - drift
    np.testing.assert_allclose(pulled[~worse], 0.0, atol=1e-12)
    share = pulled[worse] / (first - second)[worse]
    assert ((share >= -1e-9) & (share <= 1.0 + 1e-9)).all()


def test_the_generator_decides_all_numbers() -> None:
    positions = [search(Watched(0.3), seed).position for seed in (0, 0, 1)]
    np.testing.assert_array_equal(positions[0], positions[1])
    assert not np.array_equal(positions[0], positions[2])
