"""Value networks: the expected return of an observation.

Shapes: `B` batch, `O` observation.
"""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
import torch
from torch import Tensor, nn

from codesign_bench.learning.features import Features
from codesign_bench.learning.networks import MLP, GraphNetwork, RunningNorm, torch_generator
from codesign_bench.task import Task


class ValueNetwork(nn.Module):
    """Maps observations (B, O) to returns (B,), normalised by their running mean and standard deviation."""

    def __init__(self) -> None:
        super().__init__()
        # Mean 0 and variance 1 is the identity: with `normalize_returns` off, the statistics stay like this.
        self.returns = RunningNorm([-1.0], [1.0])
        with torch.no_grad():
            self.returns.variance.fill_(1.0)

    @abstractmethod
    def update_statistics(self, observation: Tensor) -> None:
        """Update the running normalisation of the inputs with observations (B, O)."""

    def update_returns(self, returns: Tensor) -> None:
        """Update the running mean and standard deviation of returns with returns (B,)."""
        self.returns.update(returns[:, None])

    def normalized(self, returns: Tensor) -> Tensor:
        """Map (B,) returns to the network's normalised units."""
        return ((returns - self.returns.mean) / (self.returns.variance + 1e-8).sqrt()).float()

    def denormalized(self, observation: Tensor) -> Tensor:
        """Return the expected returns (B,), in units of the reward, for observations (B, O)."""
        values: Tensor = self(observation)
        return (values * (self.returns.variance + 1e-8).sqrt() + self.returns.mean).float()


class GraphValue(ValueNetwork):
    """Graph network over the tool with the phase as an additional input; a tanh MLP reads it at the held link."""

    def __init__(
        self, task: Task, graph_sizes: tuple[int, ...], mlp_sizes: tuple[int, ...], rng: np.random.Generator
    ) -> None:
        super().__init__()
        generator = torch_generator(rng)
        self.features = Features(task)
        self.norm = RunningNorm.over(*self.features.boxes)
        shared = self.features.size + self.features.PHASES
        self.graph = GraphNetwork(shared, self.features.node_width, graph_sizes, task.tool_graph, [0], generator)
        self.mlp = MLP([graph_sizes[-1], *mlp_sizes, 1], generator)

    def forward(self, observation: Tensor) -> Tensor:
        """Map (B, O) to (B,)."""
        shared = torch.cat([self.norm(self.features.task(observation)), self.features.phase(observation)], dim=1)
        values: Tensor = self.mlp(self.graph(shared, self.features.nodes(observation))[0])[:, 0]
        return values

    def update_statistics(self, observation: Tensor) -> None:
        """Update the normalisation of state and goal."""
        self.norm.update(self.features.task(observation))


class MLPValue(ValueNetwork):
    """Tanh MLP on state, goal, design and phase."""

    def __init__(self, task: Task, sizes: tuple[int, ...], rng: np.random.Generator) -> None:
        super().__init__()
        self.features = Features(task)
        self.norm = RunningNorm.over(*self.features.boxes)
        self.mlp = MLP([self.features.flat_size, *sizes, 1], torch_generator(rng))

    def forward(self, observation: Tensor) -> Tensor:
        """Map (B, O) to (B,)."""
        values: Tensor = self.mlp(self.features.flat(observation, self.norm))[:, 0]
        return values

    def update_statistics(self, observation: Tensor) -> None:
        """Update the normalisation of state and goal."""
        self.norm.update(self.features.task(observation))


class DesignValue(ValueNetwork):
    """Small tanh MLP on state and goal: the baseline of the design step under separate credit (ours)."""

    SIZES = (64, 64)

    def __init__(self, task: Task, rng: np.random.Generator) -> None:
        super().__init__()
        self.features = Features(task)
        self.norm = RunningNorm.over(*self.features.boxes)
        self.mlp = MLP([self.features.size, *self.SIZES, 1], torch_generator(rng))

    def forward(self, observation: Tensor) -> Tensor:
        """Map (B, O) to (B,)."""
        values: Tensor = self.mlp(self.norm(self.features.task(observation)))[:, 0]
        return values

    def update_statistics(self, observation: Tensor) -> None:
        """Update the normalisation of state and goal."""
        self.norm.update(self.features.task(observation))
