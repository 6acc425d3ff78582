"""Value networks learn returns in units of their running mean and deviation, and see what they should."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch
from torch import Tensor

from codesign_bench.learning.value_networks import DesignValue, GraphValue, MLPValue, ValueNetwork
from codesign_bench.task import Task, load_task
from tolerances import of_sum

pytestmark = pytest.mark.numeric

Make = Callable[[Task, np.random.Generator], ValueNetwork]
KINDS: dict[str, Make] = {
    "graph": lambda task, rng: GraphValue(task, (8, 8), (8,), rng),
    "mlp": lambda task, rng: MLPValue(task, (8, 8), rng),
    "design": DesignValue,
}
EVERY_KIND = pytest.mark.parametrize("kind", KINDS)


class AlwaysOne(ValueNetwork):
    """Expects returns of one deviation above their mean."""

    def forward(self, observation: Tensor) -> Tensor:
        """Return 1 for each row."""
        return torch.ones(len(observation))

    def update_statistics(self, observation: Tensor) -> None:
        """Keep no statistics."""


def network(kind: str, seed: int = 0) -> ValueNetwork:
    """Return a small network for push."""
    return KINDS[kind](load_task("push"), np.random.default_rng(seed))


def observations(count: int = 4) -> Tensor:
    """Return observations of push, all entries within their usual size."""
    return torch.rand(count, load_task("push").layout.size, generator=torch.Generator().manual_seed(0))


def changed(observation: Tensor, part: slice, by: float = 0.5) -> Tensor:
    """Return observations in which one part is another."""
    result = observation.clone()
    result[:, part] += by
    return result


def test_returns_are_learned_in_units_of_their_mean_and_deviation() -> None:
    value = AlwaysOne()
    value.update_returns(torch.tensor([2.0, 6.0]))  # of mean 4 and deviation 2
    # 1e-8 is added to a variance of 4, and each number is rounded once or twice.
    tolerance = of_sum(2, 10.0) + 1e-8
    np.testing.assert_allclose(value.normalized(torch.tensor([4.0, 6.0, 0.0])), [0.0, 1.0, -2.0], atol=tolerance)
    np.testing.assert_allclose(value.denormalized(torch.zeros(3, 1)), [6.0, 6.0, 6.0], atol=tolerance)


def test_before_the_first_returns_a_network_puts_out_returns_as_they_are() -> None:
    value = AlwaysOne()
    np.testing.assert_allclose(value.denormalized(torch.zeros(2, 1)), [1.0, 1.0], atol=of_sum(2) + 1e-8)
    np.testing.assert_allclose(value.normalized(torch.tensor([-3.0])), [-3.0], atol=of_sum(2, 3.0) + 3e-8)


@EVERY_KIND
def test_a_value_is_one_number_per_observation_and_comes_back_from_its_units(kind: str) -> None:
    value, seen = network(kind), observations()
    value.update_returns(torch.tensor([-10.0, 30.0]))
    assert value(seen).shape == (4,)
    returns = value.denormalized(seen)
    # Values of order one in units of 20 are rounded twice there and once back.
    np.testing.assert_allclose(value.normalized(returns).detach(), value(seen).detach(), atol=of_sum(4, 4.0))


@pytest.mark.parametrize(("kind", "sees"), [("graph", True), ("mlp", True), ("design", False)])
def test_the_design_steps_baseline_sees_neither_design_nor_phase(kind: str, sees: bool) -> None:
    value, seen, layout = network(kind), observations(), load_task("push").layout
    assert not torch.equal(value(changed(seen, layout.goal)), value(seen))
    phase = slice(layout.phase.start, layout.phase.start + 2)
    for part in (layout.design, phase):
        assert torch.equal(value(changed(seen, part)), value(seen)) != sees


@EVERY_KIND
def test_inputs_are_normalised_by_what_was_seen(kind: str) -> None:
    value, seen = network(kind), observations()
    before = value(seen)
    value.update_statistics(100.0 * seen)
    assert not torch.equal(value(seen), before)


@EVERY_KIND
def test_weights_follow_their_generator(kind: str) -> None:
    seen = observations()
    assert torch.equal(network(kind, seed=1)(seen), network(kind, seed=1)(seen))
    assert not torch.equal(network(kind, seed=1)(seen), network(kind, seed=2)(seen))
