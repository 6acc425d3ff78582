"""The collector asks any explorer for actions, hands it noise, and keeps what it says of them.

Shapes: `S` slots, `b` slots that take a step at once.
"""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.learning.explorer import Explorer, FixedDesigns, Sample, Trial, UniformDesigns
from codesign_bench.learning.rollout import Collector
from codesign_bench.method import Problem
from codesign_bench.task import Singles, Slots, Task

STEPS, SLOTS = 60, 4


class Loud(Explorer):
    """Acts by its noise alone, and reports slots and noise."""

    def __init__(self, design_noise: int = 1, control_noise: int = 2) -> None:
        super().__init__(design_noise, control_noise)
        self.shapes: set[tuple[str, int]] = set()

    def sample_design(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Design by the first number, or the middle."""
        return self._sample("design", slots, noise, {})

    def sample_control(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Act by the first number, or not at all."""
        return self._sample("control", slots, noise, {"noise": noise, "slot": slots.astype(np.float32)})

    def _sample(self, phase: str, slots: Slots, noise: Singles, extras: dict[str, Singles]) -> Sample:
        self.shapes.add((phase, noise.shape[1]))
        actions = noise[:, :1] if noise.shape[1] else np.zeros((len(slots), 1), np.float32)
        return Sample(actions, extras)


@pytest.fixture
def collector(reach: Task) -> Collector:
    """Plays the stick on a line."""
    return Collector(Problem(reach))


def test_extras_lie_beside_the_steps_that_they_were_reported_for(collector: Collector) -> None:
    batch = collector.collect(Loud(), STEPS, SLOTS, np.random.default_rng(0), first_slot=10)
    controlling = batch.valid & ~batch.is_design
    assert batch.extras["noise"].shape == (*batch.valid.shape, 2)
    np.testing.assert_array_equal(batch.extras["noise"][controlling][:, 0], batch.control[controlling][:, 0])
    assert not batch.extras["noise"][~controlling].any()
    expected = np.broadcast_to(10.0 + np.arange(SLOTS)[:, None], controlling.shape)
    np.testing.assert_array_equal(batch.extras["slot"][controlling], expected[controlling])


def test_an_explorer_gets_as_much_noise_as_it_asks_for(collector: Collector) -> None:
    for sizes in ((1, 2), (0, 0), (3, 1)):
        explorer = Loud(*sizes)
        collector.collect(explorer, STEPS, SLOTS, np.random.default_rng(0))
        assert explorer.shapes == {("design", sizes[0]), ("control", sizes[1])}


def test_an_explorer_without_noise_moves_only_the_instances(collector: Collector) -> None:
    rng, other = np.random.default_rng(0), np.random.default_rng(0)
    batch = collector.collect(Loud(0, 0), STEPS, SLOTS, rng)
    starts = batch.is_design.sum(axis=0)
    for count in starts[starts > 0].tolist():
        collector.problem.sample_instances(other, count)
    assert rng.bit_generator.state == other.bit_generator.state


def test_fixed_designs_belong_to_their_slots(collector: Collector) -> None:
    designs = np.linspace(-1.0, 1.0, 2 * SLOTS, dtype=np.float32)[:, None]
    explorer = FixedDesigns(Loud(), Trial(designs))
    batch = collector.collect(explorer, STEPS, SLOTS, np.random.default_rng(0), first_slot=SLOTS)
    layout = collector.problem.task.layout
    for slot, design in enumerate(designs[SLOTS:]):
        assert (batch.design[slot, batch.is_design[slot]] == design).all()
        controlling = batch.valid[slot] & ~batch.is_design[slot]
        assert (batch.observation[slot, controlling][:, layout.design] == design[0]).all()


def test_chosen_instances_are_played_in_turn_by_every_slot(collector: Collector) -> None:
    rng = np.random.default_rng(1)
    instances = collector.problem.sample_instances(rng, 2 * SLOTS).reshape(SLOTS, 2, -1)
    explorer = FixedDesigns(Loud(), Trial(np.zeros((SLOTS, 1), np.float32), instances))
    batch = collector.collect(explorer, 4 * STEPS, SLOTS, np.random.default_rng(0))
    goal = collector.problem.task.layout.goal
    for slot in range(SLOTS):
        met = batch.observation[slot, batch.is_design[slot]][:, goal]
        assert len(met) > 2
        expected = instances[slot, np.arange(len(met)) % 2, : met.shape[1]]
        np.testing.assert_array_equal(met, expected.astype(np.float32))


def test_uniform_designs_fill_the_design_space_evenly(collector: Collector) -> None:
    batch = collector.collect(UniformDesigns(Loud(1, 0)), 60 * STEPS, SLOTS, np.random.default_rng(0))
    designs = np.sort(batch.design[batch.is_design & batch.valid][:, 0])
    assert len(designs) > 200
    assert -1.0 < designs[0] < designs[-1] < 1.0
    # Kolmogorov's distance from the uniform distribution; 1.63 / sqrt(n) is exceeded in one of a hundred samples.
    expected = 2.0 * (np.arange(len(designs)) + 0.5) / len(designs) - 1.0
    assert np.abs(designs - expected).max() / 2.0 < 1.63 / np.sqrt(len(designs))
