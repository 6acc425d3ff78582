"""Network modules: linear layers with a given generator, MLP, index MLP, graph network, running normalisation.

Shapes: `B` batch, `F` features, `H` hidden units, `N` nodes of the tool graph, `M` nodes that are needed.
Source: Transform2Act (Yuan et al. 2022), on which the paper builds, except where a line says "ours".
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from codesign_bench.task import Box, ToolGraph

MOMENTS_FEATURES = 16
"""Features whose mean and variance are computed at a time (ours)."""


def torch_generator(rng: np.random.Generator) -> torch.Generator:
    """Return a torch generator seeded by `rng`, only for initial weights; all else uses numpy generators."""
    return torch.Generator().manual_seed(int(rng.integers(2**62)))


class _Unset(nn.Linear):
    """A linear layer whose weights are yet to be set.

    `nn.Linear` draws them from torch's global generator, and so shifts it for everybody else. `nn.utils.skip_init`
    does not, but imports a library for symbolic mathematics on the way, which takes 40 MB.
    """

    def reset_parameters(self) -> None:
        """Leave the weights as they are."""


def linear(inputs: int, outputs: int, generator: torch.Generator, bias: bool = True) -> nn.Linear:
    """Return a linear layer with torch's usual initial weights, U(+-1/sqrt(inputs)), drawn from `generator`."""
    layer = _Unset(inputs, outputs, bias=bias)
    bound = inputs**-0.5
    with torch.no_grad():
        for parameter in layer.parameters():
            parameter.uniform_(-bound, bound, generator=generator)
    return layer


class _Tanh(torch.autograd.Function):
    """tanh(x) = 2 sigmoid(2x) - 1, to 1e-7: more than twice as fast as torch.tanh on processors without AVX-512."""

    @staticmethod
    def forward(ctx: Any, x: Tensor) -> Tensor:
        """Return tanh(x)."""
        y = (x + x).sigmoid_().mul_(2.0).sub_(1.0)
        ctx.save_for_backward(y)
        return y

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> Tensor:
        """Return the gradient with respect to x: that with respect to y times 1 - y^2."""
        (y,) = ctx.saved_tensors
        gradient: Tensor = torch.ops.aten.tanh_backward(gradients[0], y)
        return gradient


def tanh(x: Tensor) -> Tensor:
    """Return the hyperbolic tangent of `x`, elementwise."""
    result: Tensor = _Tanh.apply(x)
    return result


class Tanh(nn.Module):
    """The hyperbolic tangent as a layer."""

    def forward(self, x: Tensor) -> Tensor:
        """Return tanh(x), elementwise."""
        return tanh(x)


class MLP(nn.Sequential):
    """Tanh layers and a linear output layer, whose initial weights may be scaled down."""

    def __init__(
        self, sizes: Sequence[int], generator: torch.Generator, output_scale: float = 1.0, activate_last: bool = False
    ) -> None:
        layers: list[nn.Module] = []
        for index, (inputs, outputs) in enumerate(pairwise(sizes)):
            layers.append(linear(inputs, outputs, generator))
            if index < len(sizes) - 2 or activate_last:
                layers.append(Tanh())
        super().__init__(*layers)
        if output_scale != 1.0:
            with torch.no_grad():
                layers[-1].weight.mul_(output_scale)  # type: ignore[operator]  # The last layer is linear here.
                layers[-1].bias.zero_()  # type: ignore[operator]  # likewise


class IndexMLP(nn.Module):
    """Tanh layers with separate weights per node; the last layer is linear, initially scaled by 0.1 and with bias 0.

    (M, B, F) node features -> (M, B, outputs).
    """

    OUTPUT_SCALE = 0.1

    def __init__(self, num_nodes: int, sizes: Sequence[int], generator: torch.Generator) -> None:
        super().__init__()
        self.weights = nn.ParameterList()
        self.biases = nn.ParameterList()
        for inputs, outputs in pairwise(sizes):
            bound = inputs**-0.5
            self.weights.append(torch.empty(num_nodes, inputs, outputs).uniform_(-bound, bound, generator=generator))
            self.biases.append(torch.empty(num_nodes, 1, outputs).uniform_(-bound, bound, generator=generator))
        with torch.no_grad():
            # Small first outputs: means start close to the centre of [-1, 1], where actions are not clipped.
            self.weights[-1].mul_(self.OUTPUT_SCALE)
            self.biases[-1].zero_()

    def forward(self, x: Tensor) -> Tensor:
        """Map (M, B, F) to (M, B, outputs)."""
        last = len(self.weights) - 1
        for index, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            # With one node this is an ordinary layer; the plain product is several times as fast as the batched one.
            x = torch.baddbmm(bias, x, weight) if len(weight) > 1 else torch.addmm(bias[0], x[0], weight[0])[None]
            if index < last:
                x = tanh(x)
        return x


class GraphConvolution(nn.Module):
    """x_i W_own + (sum over neighbours j of x_j) W_neighbours + b, for the nodes that the next layer needs.

    Equal to torch-geometric's `GraphConv` with sum aggregation, with one dense adjacency matrix for the whole batch.
    """

    adjacency: Tensor
    kept: Tensor

    def __init__(
        self, inputs: int, outputs: int, adjacency: Tensor, kept: Sequence[int], generator: torch.Generator
    ) -> None:
        super().__init__()
        self.own = linear(inputs, outputs, generator, bias=False)
        self.neighbours = linear(inputs, outputs, generator)
        self.register_buffer("adjacency", adjacency, persistent=False)
        self.register_buffer("kept", torch.tensor(list(kept)), persistent=False)
        self._keeps_all = list(kept) == list(range(adjacency.shape[1]))

    def forward(self, x: Tensor) -> Tensor:
        """Map features (N, B, F) of this layer's nodes to features (M, B, H) of the kept nodes."""
        # All nodes share the weights, so nodes and batch are flattened into one large product per matrix.
        own, summed = self.gather(x)
        result = torch.addmm(self.neighbours.bias, summed.flatten(0, 1), self.neighbours.weight.t())
        result = torch.addmm(result, own.flatten(0, 1), self.own.weight.t())
        return result.view(*own.shape[:2], -1)

    def gather(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """Return the kept nodes' features and the sums over their neighbours, each (M, B, F), of x (N, B, F)."""
        nodes, batch, features = x.shape
        summed = (self.adjacency @ x.reshape(nodes, batch * features)).view(-1, batch, features)
        return x if self._keeps_all else x[self.kept], summed


class GraphNetwork(nn.Module):
    """A linear input layer and graph convolutions with ReLU on one fixed tool graph, read at some of its nodes.

    The inputs of a node are features that all nodes share, (B, F), and its own, (N, B, P) or none. A layer computes
    only the nodes that can still influence a node that is read; the outputs are the same (ours).
    """

    def __init__(
        self,
        shared: int,
        own: int,
        hidden: Sequence[int],
        graph: ToolGraph,
        read: Sequence[int],
        generator: torch.Generator,
    ) -> None:
        super().__init__()
        self.num_nodes = graph.num_nodes
        self.shared = linear(shared, hidden[0], generator)
        self.own = linear(own, hidden[0], generator, bias=False) if own else None
        adjacency = adjacency_matrix(graph)
        # Backwards from the output: to compute a node, a layer needs this node and its neighbours from the layer
        # before. With the held link as the only output, the last layer computes one node instead of all.
        needed = [sorted(read)]
        for _ in hidden:
            needed.append(sorted({*needed[-1], *(int(j) for i in needed[-1] for j in adjacency[i].nonzero()[:, 0])}))
        needed.reverse()
        self.inputs = needed[0]
        sizes = [hidden[0], *hidden]
        self.layers = nn.ModuleList()
        for index in range(len(hidden)):
            before, after = needed[index], needed[index + 1]
            block = adjacency[after][:, before]
            kept = [before.index(node) for node in after]
            self.layers.append(GraphConvolution(sizes[index], sizes[index + 1], block, kept, generator))

    def forward(self, shared: Tensor, own: Tensor | None = None) -> Tensor:
        """Map shared (B, F) and own (N, B, P) features to features (M, B, H) of the read nodes, in ascending order."""
        x = torch.relu(self._first(shared, own))
        for layer in list(self.layers)[1:]:
            x = torch.relu(layer(x))
        return x

    def _first(self, shared: Tensor, own: Tensor | None) -> Tensor:
        """Return the first convolution's (M, B, H) output, before its ReLU.

        There is no nonlinearity between the input layer and the first convolution. So the shared features are
        multiplied once for all nodes, and the nodes' own features by one product of the two layers' weights.
        """
        layer: GraphConvolution = self.layers[0]  # type: ignore[assignment]  # ModuleList is not typed by its items
        # The convolution's input at node i is h + g_i: the input layer maps the shared features to h and the node's own
        # features to g_i. With d_i neighbours the output is
        #     h W_own + d_i h W_neighbours + b  +  g_i W_own + (sum over neighbours j of g_j) W_neighbours,
        # where h W_own and h W_neighbours are the same for all nodes: two products in total instead of two per node.
        hidden = self.shared(shared)
        once = nn.functional.linear(hidden, layer.own.weight, layer.neighbours.bias)
        per_neighbour = nn.functional.linear(hidden, layer.neighbours.weight)
        x = torch.addcmul(once, layer.adjacency.sum(1)[:, None, None], per_neighbour)
        if self.own is None or own is None:
            return x
        # g_i is linear in the node's few features, so the weights of the two layers are multiplied first, once for all
        # rows. The product of weights is small; the product of rows with the hidden width would not be.
        own = own[self.inputs] if len(self.inputs) < self.num_nodes else own
        weight = torch.cat([layer.own.weight @ self.own.weight, layer.neighbours.weight @ self.own.weight], dim=1)
        features = torch.cat(layer.gather(own), dim=-1).flatten(0, 1)
        return torch.addmm(x.flatten(0, 1), features, weight.t()).view_as(x)


def adjacency_matrix(graph: ToolGraph) -> Tensor:
    """Return the symmetric adjacency matrix (N, N) of a tool graph, without self-loops."""
    matrix = torch.zeros(graph.num_nodes, graph.num_nodes)
    for i, j in graph.edges:
        matrix[i, j] = matrix[j, i] = 1.0
    return matrix


def _moments(values: Tensor) -> tuple[Tensor, Tensor]:
    """Return mean and variance (F,) of values (B, F) in double precision."""
    # A few features at a time, because a copy in double precision takes twice the memory of the batch.
    parts = map(Tensor.double, values.split(MOMENTS_FEATURES, dim=1))
    means, variances = zip(*((part.mean(0), part.var(0, unbiased=False)) for part in parts), strict=True)
    return torch.cat(means), torch.cat(variances)


class RunningNorm(nn.Module):
    """Normalises features by their running mean and standard deviation, clipped to +-5.

    Before the first update, it maps the bounds of each feature to +-2 (ours), so that inputs are of order one in the
    first rollout as well.
    """

    CLIP = 5.0
    mean: Tensor
    variance: Tensor
    count: Tensor

    def __init__(self, low: Sequence[float], high: Sequence[float]) -> None:
        super().__init__()
        low_tensor, high_tensor = torch.tensor(low, dtype=torch.float64), torch.tensor(high, dtype=torch.float64)
        self.register_buffer("mean", 0.5 * (low_tensor + high_tensor))
        self.register_buffer("variance", (0.25 * (high_tensor - low_tensor)) ** 2)
        self.register_buffer("count", torch.zeros((), dtype=torch.float64))

    @classmethod
    def over(cls, *boxes: Box) -> RunningNorm:
        """Return a normaliser for the entries of `boxes`, concatenated."""
        return cls([v for box in boxes for v in box.low], [v for box in boxes for v in box.high])

    def update(self, values: Tensor) -> None:
        """Update the running mean and variance with values (B, F) (Chan et al. 1979)."""
        # Merging two sets: the variances within each, weighted by size, plus the spread between their means. Unlike a
        # sum of squares this does not cancel when the mean is large, and double precision keeps small batches from
        # being lost against a large count.
        count = values.shape[0]
        total = self.count + count
        mean, variance = _moments(values)
        difference = mean - self.mean
        weight = count / total
        # The initial mean and variance come from bounds, not data: the first batch replaces them instead of mixing.
        old = torch.where(self.count > 0, self.variance * (self.count / total), torch.zeros_like(self.variance))
        cross = torch.where(self.count > 0, difference**2 * weight * (1 - weight), torch.zeros_like(self.variance))
        self.variance.copy_(old + variance * weight + cross)
        self.mean.add_(difference * weight)
        self.count.copy_(total)

    def forward(self, values: Tensor) -> Tensor:
        """Normalise (B, F) values."""
        # A feature that has been constant so far has no variance; the first value that differs is clipped instead of
        # dominating the layer.
        scale = (self.variance + 1e-8).rsqrt().float()
        return ((values - self.mean.float()) * scale).clamp(-self.CLIP, self.CLIP)
