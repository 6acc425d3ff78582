"""Networks against independent computations: torch-geometric, one layer per node, numpy.

Shapes: `B` batch, `F` features, `N` nodes.
"""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from codesign_bench.learning.networks import (
    MLP,
    MOMENTS_FEATURES,
    GraphConvolution,
    GraphNetwork,
    IndexMLP,
    RunningNorm,
    adjacency_matrix,
    torch_generator,
)
from codesign_bench.task import ToolGraph
from tolerances import DOUBLE, SINGLE, of_network, of_sum

pytestmark = pytest.mark.numeric

RECORD = json.loads((Path(__file__).parent.parent / "data" / "graph_convolution.json").read_text(encoding="utf-8"))
STAR = ToolGraph(num_nodes=5, edges=((0, 1), (1, 2), (2, 3), (1, 4)), parameter_nodes=(0, 1, 2, 3, 4))
CHAIN = ToolGraph(num_nodes=3, edges=((0, 1), (1, 2)), parameter_nodes=(0, 1, 2))
LARGEST = 4.0
"""Hardly a standard normal number is larger."""


def generator(seed: int = 0) -> torch.Generator:
    """Return a generator for weights."""
    return torch_generator(np.random.default_rng(seed))


def weights(module: torch.nn.Module) -> list[float]:
    """Return all of a module's weights in one list."""
    return torch.cat([parameter.flatten() for parameter in module.parameters()]).tolist()


def test_graph_convolution_gives_the_recorded_numbers_of_torch_geometric() -> None:
    graph = ToolGraph(num_nodes=4, edges=tuple((i, j) for i, j in RECORD["edges"]), parameter_nodes=(0, 1, 2, 3))
    layer = GraphConvolution(3, 2, adjacency_matrix(graph), range(4), generator())
    with torch.no_grad():
        layer.own.weight.copy_(torch.tensor(RECORD["own_weight"]))
        layer.neighbours.weight.copy_(torch.tensor(RECORD["neighbours_weight"]))
        layer.neighbours.bias.copy_(torch.tensor(RECORD["bias"]))
        output = layer(torch.tensor(RECORD["x"])[:, None])[:, 0]
    # A sum over three inputs of a node and of up to three neighbours, and the bias; no product exceeds one.
    np.testing.assert_allclose(output.numpy(), RECORD["output"], rtol=0, atol=of_sum(3 + 3 * 3 + 1, 13.0))


def test_graph_network_equals_torch_geometric_live() -> None:
    geometric = pytest.importorskip("torch_geometric.nn")
    network = GraphNetwork(4, 2, (8, 8, 6), STAR, range(5), generator())
    shared, own = torch.randn(7, 4, generator=generator(1)), torch.randn(5, 7, 2, generator=generator(2))
    edges = torch.tensor([*STAR.edges, *((j, i) for i, j in STAR.edges)]).t()
    with torch.no_grad():
        expected = network.shared(shared) + own @ network.own.weight.t()
        for layer in network.layers:
            reference: Any = geometric.GraphConv(layer.own.in_features, layer.own.out_features, aggr="add", node_dim=0)
            reference.lin_root.weight.copy_(layer.own.weight)
            reference.lin_rel.weight.copy_(layer.neighbours.weight)
            reference.lin_rel.bias.copy_(layer.neighbours.bias)
            expected = torch.relu(reference(expected, edges))
        widths, neighbours = (4 + 2, 2 * 8, 2 * 8, 2 * 8), 3.0  # A convolution sums over a node and its neighbours.
        tolerance = of_network(widths, neighbours * LARGEST)
        np.testing.assert_allclose(network(shared, own).numpy(), expected.numpy(), rtol=0, atol=tolerance)


@pytest.mark.parametrize("graph", [STAR, CHAIN])
@pytest.mark.parametrize("layers", [1, 2, 3])
def test_computing_only_the_needed_nodes_changes_nothing(graph: ToolGraph, layers: int) -> None:
    shared = torch.randn(7, 4, generator=generator(1))
    own = torch.randn(graph.num_nodes, 7, 2, generator=generator(2))
    whole = GraphNetwork(4, 2, (8,) * layers, graph, range(graph.num_nodes), generator())
    for read in ([0], [graph.num_nodes - 1], [0, 2]):
        part = GraphNetwork(4, 2, (8,) * layers, graph, read, generator())
        part.load_state_dict(whole.state_dict())
        with torch.no_grad():
            found, expected = part(shared, own).numpy(), whole(shared, own)[read].numpy()
            tolerance = of_network((4 + 2, *[2 * 8] * layers), LARGEST)
            np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


def test_a_node_sees_as_far_as_there_are_layers() -> None:
    def held_link(layers: int, tip: float) -> list[float]:
        own = torch.zeros(3, 1, 1)
        own[2] = tip
        network = GraphNetwork(1, 1, (16,) * layers, CHAIN, [0], generator())
        with torch.no_grad():
            return network(torch.ones(1, 1), own)[0, 0].tolist()

    assert held_link(1, 0.0) == held_link(1, 1.0)
    assert held_link(2, 0.0) != held_link(2, 1.0)


def test_index_mlp_is_one_perceptron_per_node() -> None:
    sizes = [4, 8, 3]
    network = IndexMLP(3, sizes, generator())
    x = torch.randn(3, 7, 4, generator=generator(1))
    with torch.no_grad():
        output = network(x)
        for node in range(3):
            expected = x[node]
            for index in range(len(sizes) - 1):
                layer = torch.nn.Linear(*sizes[index : index + 2])
                layer.weight.copy_(network.weights[index][node].t())
                layer.bias.copy_(network.biases[index][node, 0])
                expected = layer(torch.tanh(expected) if index else expected)
            tolerance = of_network(sizes[:-1], LARGEST)
            np.testing.assert_allclose(output[node].numpy(), expected.numpy(), rtol=0, atol=tolerance)
    assert not torch.equal(network.weights[0][0], network.weights[0][1])


def test_index_mlp_of_one_node_takes_the_same_path_in_numbers() -> None:
    one, two = IndexMLP(1, [4, 8, 3], generator()), IndexMLP(2, [4, 8, 3], generator(1))
    with torch.no_grad():
        for small, large in zip(one.parameters(), two.parameters(), strict=True):
            large[:1].copy_(small)
        x = torch.randn(2, 7, 4, generator=generator(2))
        tolerance = of_network((4, 8), LARGEST)
        np.testing.assert_allclose(one(x[:1])[0].numpy(), two(x)[0].numpy(), rtol=0, atol=tolerance)


def test_last_layers_start_small_and_without_bias() -> None:
    network = IndexMLP(3, [64, 64, 2], generator())
    assert not network.biases[-1].any()
    assert 0.0 < network.weights[-1].abs().max() <= IndexMLP.OUTPUT_SCALE * 64**-0.5
    assert network.weights[0].abs().max() > IndexMLP.OUTPUT_SCALE * 64**-0.5
    small, usual = MLP([64, 64, 2], generator(), output_scale=0.1), MLP([64, 64, 2], generator())
    np.testing.assert_allclose(small[-1].weight.detach(), 0.1 * usual[-1].weight.detach(), rtol=2.0 * SINGLE)
    assert not small[-1].bias.any()
    assert usual[-1].bias.any()
    np.testing.assert_array_equal(small[0].weight.detach(), usual[0].weight.detach())


def test_weights_follow_their_generator_alone() -> None:
    before = torch.get_rng_state()

    def make(seed: int) -> list[list[float]]:
        own = generator(seed)
        return [
            weights(MLP([3, 8, 2], own)),
            weights(IndexMLP(2, [3, 8, 2], own)),
            weights(GraphNetwork(3, 1, (8, 8), CHAIN, [0], own)),
        ]

    assert make(1) == make(1)
    assert all(first != second for first, second in zip(make(1), make(2), strict=True))
    assert torch.equal(before, torch.get_rng_state())


def test_running_norm_follows_mean_and_variance_over_batches() -> None:
    rng = np.random.default_rng(0)
    features = 2 * MOMENTS_FEATURES + 1
    norm = RunningNorm([-1.0] * features, [1.0] * features)
    batches = [rng.normal(loc, 1.0 + loc, size=(count, features)) for loc, count in ((0.0, 5), (3.0, 1), (40.0, 300))]
    for batch in batches:
        norm.update(torch.from_numpy(batch))
    values = np.concatenate(batches)
    largest = np.abs(values).max()
    np.testing.assert_allclose(norm.mean.numpy(), values.mean(axis=0), rtol=0, atol=of_sum(306, largest, DOUBLE))
    np.testing.assert_allclose(norm.variance.numpy(), values.var(axis=0), rtol=0, atol=of_sum(306, largest**2, DOUBLE))
    assert norm.count == len(values)
    normal = norm(torch.from_numpy(values).float()).numpy()
    expected = (values - values.mean(axis=0)) / values.std(axis=0)
    tolerance = of_sum(4, (largest / values.std(axis=0)).max())  # value, mean, scale and result are rounded
    np.testing.assert_allclose(normal, expected.clip(-5.0, 5.0), rtol=0, atol=tolerance)


def test_running_norm_clips_and_knows_the_bounds_before_the_first_batch() -> None:
    norm = RunningNorm([2.0], [10.0])
    values = torch.tensor([[2.0], [6.0], [10.0], [1e6]])
    expected = [-2.0, 0.0, 2.0, RunningNorm.CLIP]
    np.testing.assert_allclose(norm(values)[:, 0].numpy(), expected, rtol=0, atol=of_sum(4, 10.0 / 2.0))
    constant = RunningNorm([0.0], [1.0])
    constant.update(torch.full((4, 1), 3.0))
    assert constant(torch.tensor([[3.0]])).item() == 0.0


def test_adjacency_is_symmetric_without_loops() -> None:
    matrix = adjacency_matrix(STAR)
    assert torch.equal(matrix, matrix.t())
    assert matrix.sum() == 2 * len(STAR.edges)
    assert not matrix.diagonal().any()


def test_perceptrons_have_tanh_between_linear_layers() -> None:
    network, x = MLP([3, 8, 4, 2], generator()), torch.randn(5, 3, generator=generator(1))
    linears = [layer for layer in network if isinstance(layer, torch.nn.Linear)]
    with torch.no_grad():
        expected = x
        for layer, following in pairwise([*linears, None]):
            expected = expected @ layer.weight.t() + layer.bias
            expected = torch.tanh(expected) if following is not None else expected
        np.testing.assert_allclose(network(x).numpy(), expected.numpy(), rtol=0, atol=of_network((3, 8, 4), LARGEST))
