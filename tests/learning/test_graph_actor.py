"""Graph designer and controller: every link puts out its own parameters, and the held link decides the control.

On push the tool has three links and five parameters: three lengths, and the angles of the joints behind the second
and the third link.
"""

from __future__ import annotations

import numpy as np
import pytest
import torch
from torch import Tensor

from codesign_bench.learning.graph_actor import GraphController, GraphDesigner
from codesign_bench.task import load_task
from tolerances import of_sum

pytestmark = pytest.mark.numeric

TASK = load_task("push")
LAYOUT = TASK.layout


def designer(seed: int = 0) -> GraphDesigner:
    """Return a small designer."""
    return GraphDesigner(TASK, (8, 8), (8,), np.random.default_rng(seed))


def controller(layers: int = 2) -> GraphController:
    """Return a small controller with so many graph convolutions."""
    return GraphController(TASK, (8,) * layers, (8,), np.random.default_rng(0))


def observations(count: int = 4) -> Tensor:
    """Return observations of push, all entries within their usual size."""
    return torch.rand(count, LAYOUT.size, generator=torch.Generator().manual_seed(0))


def changed(part: slice | int) -> Tensor:
    """Return the observations with one part of them another."""
    result = observations()
    result[:, part] += 0.5
    return result


def test_a_designer_puts_out_a_mean_for_every_parameter() -> None:
    assert designer()(observations()).shape == (4, 5)


def test_every_link_puts_out_its_own_parameters_and_no_others() -> None:
    assert TASK.tool_graph.parameter_nodes == (0, 1, 2, 1, 2)
    network = designer()
    before = network(observations())
    with torch.no_grad():
        network.index_mlp.biases[-1][1] += torch.tensor([1.0, 2.0])  # of the second link: its length, its angle
    difference = (network(observations()) - before).detach().numpy()
    np.testing.assert_allclose(difference, np.tile([0.0, 1.0, 0.0, 2.0, 0.0], (4, 1)), rtol=0, atol=of_sum(2, 4.0))


def test_a_designer_sees_state_and_goal_alone() -> None:
    network = designer()
    before = network(observations())
    assert not torch.equal(network(changed(LAYOUT.goal)), before)
    assert torch.equal(network(changed(LAYOUT.design)), before)
    assert torch.equal(network(changed(LAYOUT.phase)), before)


def test_a_controller_sees_state_goal_and_design_and_puts_out_a_mean_control() -> None:
    network = controller()
    before = network(observations())
    assert before.shape == (4, TASK.control_space.size)
    for part in (LAYOUT.state, LAYOUT.goal, LAYOUT.design):
        assert not torch.equal(network(changed(part)), before)
    assert torch.equal(network(changed(LAYOUT.phase)), before)


def test_the_held_link_hears_of_the_last_one_through_as_many_layers_as_lie_between() -> None:
    last_length = LAYOUT.design.start + 2
    for layers, hears in ((1, False), (2, True)):
        network = controller(layers)
        assert torch.equal(network(changed(last_length)), network(observations())) != hears


@pytest.mark.parametrize("make", [designer, controller])
def test_inputs_are_normalised_by_what_was_seen(make: type) -> None:
    network = make()
    before = network(observations())
    network.update_statistics(100.0 * observations())
    assert not torch.equal(network(observations()), before)


def test_weights_follow_their_generator() -> None:
    assert torch.equal(designer(1)(observations()), designer(1)(observations()))
    assert not torch.equal(designer(1)(observations()), designer(2)(observations()))
