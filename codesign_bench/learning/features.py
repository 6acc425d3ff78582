"""Split an observation into inputs of networks.

Shapes: `B` batch, `O` observation, `N` nodes of the tool graph, `P` largest number of design parameters of a node.

The inputs are state, goal, design and phase, but not the elapsed time: with a bootstrapped time limit, the value of a
state does not depend on the elapsed time (Pardo et al. 2018).
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from codesign_bench.learning.networks import RunningNorm
from codesign_bench.task import Task


class Features(nn.Module):
    """The parts of a task's observations, as tensors."""

    PHASES = 2
    parameter_index: Tensor

    def __init__(self, task: Task) -> None:
        super().__init__()
        self.layout = task.layout
        self.boxes = (task.state_space, task.goal_space)
        self.size = self.layout.goal.stop
        """Total length of state and goal."""
        owners = task.tool_graph.parameter_nodes
        of_node = [[d for d, owner in enumerate(owners) if owner == node] for node in range(task.tool_graph.num_nodes)]
        self.node_width = max(len(parameters) for parameters in of_node)
        """P"""
        # Nodes may own different numbers of parameters, but their features form one tensor. Missing entries point to
        # one zero behind the design (see `nodes`), so that a single indexing gathers the parameters of all nodes.
        absent = len(owners)
        padded = [parameters + [absent] * (self.node_width - len(parameters)) for parameters in of_node]
        self.register_buffer("parameter_index", torch.tensor(padded), persistent=False)
        self.node_parameters = of_node
        self.flat_size = self.layout.design.stop + self.PHASES
        """Total length of state, goal, design and phase."""

    def task(self, observation: Tensor) -> Tensor:
        """Return state and goal of (B, O) observations."""
        return observation[:, : self.size]

    def phase(self, observation: Tensor) -> Tensor:
        """Return the one-hot phase (B, 2) of (B, O) observations."""
        start = self.layout.phase.start
        return observation[:, start : start + self.PHASES]

    def nodes(self, observation: Tensor) -> Tensor:
        """Return each node's design parameters (N, B, P), padded with zeros, of (B, O) observations."""
        design = nn.functional.pad(observation[:, self.layout.design], (0, 1))
        return design[:, self.parameter_index].transpose(0, 1)

    def flat(self, observation: Tensor, norm: RunningNorm) -> Tensor:
        """Return normalised state and goal, design and phase, (B, flat_size), of (B, O) observations."""
        design = observation[:, self.layout.design]
        return torch.cat([norm(self.task(observation)), design, self.phase(observation)], dim=1)
