"""Graph-network designer and controller (Transform2Act's architecture, on which the paper's is built).

Shapes: `B` batch, `O` observation, `D` design, `C` control, `N` nodes of the tool graph.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from codesign_bench.learning.features import Features
from codesign_bench.learning.networks import GraphNetwork, IndexMLP, RunningNorm, torch_generator
from codesign_bench.task import Task


class GraphDesigner(nn.Module):
    """Graph network over the tool, then an index MLP: every link outputs its own design parameters.

    The links have no properties before the design step, so the only inputs of a node are state and goal.
    """

    owner: Tensor
    position: Tensor

    def __init__(
        self, task: Task, graph_sizes: tuple[int, ...], index_sizes: tuple[int, ...], rng: np.random.Generator
    ) -> None:
        super().__init__()
        generator = torch_generator(rng)
        self.features = Features(task)
        self.norm = RunningNorm.over(*self.features.boxes)
        nodes = task.tool_graph.num_nodes
        self.graph = GraphNetwork(self.features.size, 0, graph_sizes, task.tool_graph, range(nodes), generator)
        self.index_mlp = IndexMLP(nodes, [graph_sizes[-1], *index_sizes, self.features.node_width], generator)
        owners = task.tool_graph.parameter_nodes
        # Parameter d is output number `position[d]` of node `owner[d]`: this puts the outputs of all nodes in the order
        # of the design space. Unused outputs of nodes with fewer parameters are never read and get no gradient.
        places = [self.features.node_parameters[node].index(d) for d, node in enumerate(owners)]
        self.register_buffer("owner", torch.tensor(owners), persistent=False)
        self.register_buffer("position", torch.tensor(places), persistent=False)

    def forward(self, observation: Tensor) -> Tensor:
        """Map (B, O) to mean designs (B, D)."""
        outputs = self.index_mlp(self.graph(self.norm(self.features.task(observation))))
        design: Tensor = outputs[self.owner, :, self.position].t()
        return design

    def update_statistics(self, observation: Tensor) -> None:
        """Update the normalisation of state and goal."""
        self.norm.update(self.features.task(observation))


class GraphController(nn.Module):
    """Graph network over the designed tool; an index MLP reads it at the held link, which the robot moves (ours)."""

    def __init__(
        self, task: Task, graph_sizes: tuple[int, ...], index_sizes: tuple[int, ...], rng: np.random.Generator
    ) -> None:
        super().__init__()
        generator = torch_generator(rng)
        self.features = Features(task)
        self.norm = RunningNorm.over(*self.features.boxes)
        width = self.features.node_width
        self.graph = GraphNetwork(self.features.size, width, graph_sizes, task.tool_graph, [0], generator)
        self.index_mlp = IndexMLP(1, [graph_sizes[-1], *index_sizes, task.control_space.size], generator)

    def forward(self, observation: Tensor) -> Tensor:
        """Map (B, O) to mean controls (B, C)."""
        shared = self.norm(self.features.task(observation))
        control: Tensor = self.index_mlp(self.graph(shared, self.features.nodes(observation)))[0]
        return control

    def update_statistics(self, observation: Tensor) -> None:
        """Update the normalisation of state and goal."""
        self.norm.update(self.features.task(observation))
