"""A designer that climbs a critic: PPO for any tool, and for each goal the tool that its value network likes best.

Source: "Shape Your Body" (2606.00702), for tools with goals ours. Training is that of `random_tool`: a tool drawn
uniformly in every episode, and a controller and a value network that see it. Nothing is trained to design. For a goal,
several designs are moved up the gradient of the value of the first control step, and the one of the highest value is
built. An evaluation plays it, so a value that the critic only imagines earns nothing.

Shapes: `B` batch, `K` starts, `P` designs that are judged, `O` observation, `D` design.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
import torch
from torch import Tensor

from codesign_bench.config.values import Within
from codesign_bench.learning.actor import ActorPolicy
from codesign_bench.learning.checkpointing import below, load_module_arrays, module_arrays, prefixed
from codesign_bench.learning.ppo_config import PerceptronConfig
from codesign_bench.learning.value_networks import MLPValue, ValueNetwork
from codesign_bench.method import Array, Policy
from codesign_bench.task import Floats, Singles, Task

from ._given_design import WITHOUT_EFFECT, GivenDesignActor, GivenDesignMethod

CRITIC = "critic."
"""Prefix of the value network's arrays in a policy."""


@dataclass(frozen=True, kw_only=True)
class Config(PerceptronConfig):
    """Hyperparameters of `critic_design`: PPO's and the perceptrons', and those of the climb."""

    not_searched: ClassVar = WITHOUT_EFFECT
    """PPO learns no designs."""
    climb_starts: Annotated[int, Within(1, 1_000)] = 8
    """Designs from which the climb starts for a goal: the middle, and others spread over the design space."""
    climb_steps: Annotated[int, Within(0, 10_000)] = 40
    """Gradient steps of the climb."""
    climb_rate: Annotated[float, Within(0.0, 1.0)] = 0.05
    """Largest change of a design parameter in one of them; parameters are in [-1, 1]."""


class CriticPolicy(Policy):
    """A controller, and a value network that is climbed for a design."""

    def __init__(self, actor: GivenDesignActor, value: ValueNetwork, config: Config) -> None:
        self.actor, self.value, self.config = actor, value, config
        self._controls = ActorPolicy(actor)
        self._layout = actor.features.layout

    def act(self, observation: Singles) -> Singles:
        """Return the mean of the controller."""
        return self._controls.act(observation)

    def design(self, observation: Singles) -> Singles:
        """Return the design of the highest value that the climb found, for each observation."""
        batch = np.atleast_2d(np.asarray(observation, dtype=np.float32))
        designs = np.stack([self._climbed(torch.from_numpy(each)).numpy() for each in batch])
        return designs if np.ndim(observation) == 2 else designs[0]

    def design_values(self, observation: Singles, designs: Singles) -> Floats:
        """Return the critic's values (P,) of designs (P, D) after one observation (O,)."""
        with torch.no_grad():
            found = self.values(
                *(torch.from_numpy(np.asarray(each, dtype=np.float32)) for each in (observation, designs))
            )
        return found.numpy().astype(np.float64)

    def values(self, observation: Tensor, designs: Tensor) -> Tensor:
        """Return the critic's values (K,) of the first control step with designs (K, D) after one observation (O,)."""
        first = observation.expand(len(designs), -1).clone()
        first[:, self._layout.phase] = 0.0
        first[:, self._layout.phase.start + 1] = 1.0
        before, after = first[:, : self._layout.design.start], first[:, self._layout.design.stop :]
        values: Tensor = self.value(torch.cat([before, designs, after], dim=1))
        return values

    def _climbed(self, observation: Tensor) -> Tensor:
        """Return the best design (D,) for an observation (O,)."""
        # One goal at a time: a design must not depend, not even by rounding, on which others are asked for with it.
        designs = self.starts().requires_grad_()
        for _ in range(self.config.climb_steps):
            (slope,) = torch.autograd.grad(self.values(observation, designs).sum(), designs)
            # Scaled by its largest entry: what the values are worth must not decide how far a step goes.
            step = self.config.climb_rate * slope / slope.abs().amax(dim=1, keepdim=True).clamp_min(1e-12)
            designs = (designs.detach() + step).clamp(-1.0, 1.0).requires_grad_()
        found = designs.detach()
        with torch.no_grad():
            return found[self.values(observation, found).argmax()]

    def starts(self) -> Tensor:
        """Return the designs (K, D) from which every climb starts, the same for all goals."""
        size = self.actor.best_design.numel()
        spread = np.random.default_rng(0).uniform(-1.0, 1.0, (self.config.climb_starts - 1, size))
        return torch.from_numpy(np.concatenate([np.zeros((1, size)), spread]).astype(np.float32))

    def tensors(self) -> dict[str, Array]:
        """Return the parameters of controller and critic."""
        critic = prefixed(CRITIC, module_arrays(self.value))
        return {**module_arrays(self.actor), **critic}


class CriticDesign(GivenDesignMethod[Config]):
    """A tool for each goal by climbing the value network of a controller of any tool."""

    name = "critic_design"
    label = "critic-climbed design"
    config_class = Config

    @classmethod
    def small(cls) -> Mapping[str, Any]:
        """Return batches of a few episodes, small networks, and a short climb."""
        return {**super().small(), "climb_starts": 3, "climb_steps": 5}

    def policy(self) -> Policy:
        """Return the controller with the critic that chooses its tools."""
        return CriticPolicy(self.actor, self.learner.value, self.config)

    @classmethod
    def make_policy(cls, task: Task, config: Config, tensors: Mapping[str, Any]) -> Policy:
        """Return controller and critic with the given parameters."""
        actor = GivenDesignActor(task, config, np.random.default_rng(0))
        value = MLPValue(task, config.value_net, np.random.default_rng(0))
        load_module_arrays(value, below(CRITIC, tensors))
        load_module_arrays(actor, {name: array for name, array in tensors.items() if not name.startswith(CRITIC)})
        return CriticPolicy(actor, value, config)
