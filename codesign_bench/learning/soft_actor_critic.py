"""Soft actor-critic (Haarnoja et al. 2018) for the control phase: an off-policy learner that sees the design.

Shapes: `m` transitions of a minibatch, `b` slots, `O` observation, `D` design, `C` control.

Both networks see state, goal, design and phase, scaled by the bounds of the spaces: transitions of long ago are learned
again and again, and statistics that move would change what they say.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
import torch
from torch import Tensor, nn

from codesign_bench.config.search import Choice, Integer, LogUniform
from codesign_bench.config.validation import check_values
from codesign_bench.config.values import Share, Within
from codesign_bench.learning.explorer import Explorer, Sample
from codesign_bench.learning.features import Features
from codesign_bench.learning.networks import MLP, IndexMLP, RunningNorm, torch_generator
from codesign_bench.learning.optimizers import adam
from codesign_bench.learning.ppo_config import LearningRate, SomeWidths
from codesign_bench.learning.replay import Transitions
from codesign_bench.task import Singles, Slots, Task

LARGEST_SLOPE = 1.0
"""Entries of gradients are clipped to +-1 (source: Luck et al. 2019, code)."""


@dataclass(frozen=True, kw_only=True)
class SoftActorCriticConfig:
    """Hyperparameters of soft actor-critic."""

    minibatch_size: Annotated[int, Within(1, 100_000)] = field(
        default=256, metadata={"search": Integer(64, 512, log=True)}
    )
    """Transitions per gradient step."""
    learning_rate: LearningRate = field(default=1e-3, metadata={"search": LogUniform(1e-4, 3e-3)})
    """Adam's learning rate for actor and critics."""
    gamma: Share = field(default=0.99, metadata={"search": Choice((0.95, 0.97, 0.98, 0.99, 0.995))})
    """Discount factor per step."""
    target_rate: Share = field(default=0.005, metadata={"search": LogUniform(1e-3, 5e-2)})
    """Fraction by which target critics move towards the critics in each step."""
    temperature: Annotated[float, Within(0.0, 1_000.0)] = field(
        default=0.01, metadata={"search": LogUniform(1e-3, 0.1)}
    )
    """Weight of the entropy, in units of the rewards that the networks learn from; fixed."""
    hidden: SomeWidths = (200, 200, 200)
    """Widths of the hidden layers of actor and critics."""

    def __post_init__(self) -> None:
        check_values(self)


class SquashedActor(nn.Module):
    """tanh of a Gaussian over controls, whose mean and standard deviation depend on the observation."""

    LOG_STD = (-5.0, 2.0)

    def __init__(self, task: Task, hidden: tuple[int, ...], rng: np.random.Generator) -> None:
        super().__init__()
        self.features = Features(task)
        self.norm = RunningNorm.over(*self.features.boxes)  # never updated: scales by the bounds of the spaces
        self.size = task.control_space.size
        self.mlp = MLP([self.features.flat_size, *hidden, 2 * self.size], torch_generator(rng), output_scale=0.1)

    def forward(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean and log standard deviation, (m, C) each, before squashing, for observations (m, O)."""
        mean, log_std = self.mlp(self.features.flat(observation, self.norm)).chunk(2, dim=1)
        return mean, log_std.clamp(*self.LOG_STD)

    def control(self, observation: Tensor) -> Tensor:
        """Return the mean controls (m, C), squashed."""
        return torch.tanh(self(observation)[0])

    def sample(self, observation: Tensor, noise: Tensor) -> tuple[Tensor, Tensor]:
        """Return controls (m, C) drawn with standard-normal `noise` (m, C), and their log-probabilities (m,)."""
        mean, log_std = self(observation)
        free = mean + log_std.exp() * noise
        gaussian = -0.5 * noise**2 - log_std - 0.5 * math.log(2.0 * math.pi)
        # log(1 - tanh(u)^2), written so that it is exact where tanh(u) rounds to one.
        squashing = 2.0 * (math.log(2.0) - free - nn.functional.softplus(-2.0 * free))
        return torch.tanh(free), (gaussian - squashing).sum(1)


class SquashedExplorer(Explorer):
    """Samples an actor's controls; designs are chosen by another explorer around it."""

    def __init__(self, actor: SquashedActor) -> None:
        super().__init__(0, actor.size)
        self.actor = actor

    def sample_design(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Raise an error: the actor has no designer."""
        raise NotImplementedError

    def sample_control(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Return controls drawn with `noise` (b, C)."""
        with torch.inference_mode():
            controls, _ = self.actor.sample(torch.from_numpy(observation), torch.from_numpy(noise))
        return Sample(controls.numpy())


class TwinCritic(nn.Module):
    """Two value networks for controls; the smaller of their values is used, since each alone is learned too high."""

    def __init__(self, task: Task, hidden: tuple[int, ...], rng: np.random.Generator) -> None:
        super().__init__()
        self.features = Features(task)
        self.norm = RunningNorm.over(*self.features.boxes)  # never updated, as the actor's
        sizes = [self.features.flat_size + task.control_space.size, *hidden, 1]
        self.networks = IndexMLP(2, sizes, torch_generator(rng))

    def forward(self, observation: Tensor, control: Tensor) -> Tensor:
        """Return both values (2, m) of controls (m, C) for observations (m, O)."""
        inputs = torch.cat([self.features.flat(observation, self.norm), control], dim=1)
        values: Tensor = self.networks(inputs.expand(2, -1, -1))[..., 0]
        return values


class SoftActorCritic:
    """An actor, twin critics and their slowly moving targets, with their optimizers."""

    def __init__(
        self, task: Task, config: SoftActorCriticConfig, actor_rng: np.random.Generator, critic_rng: np.random.Generator
    ) -> None:
        self.config = config
        self.actor = SquashedActor(task, config.hidden, actor_rng)
        self.critic = TwinCritic(task, config.hidden, critic_rng)
        self.target = TwinCritic(task, config.hidden, np.random.default_rng(0))
        self.target.load_state_dict(self.critic.state_dict())
        self.optimizers: dict[str, torch.optim.Optimizer] = {}
        self._make_optimizers()

    def _make_optimizers(self) -> None:
        for name, network in (("actor", self.actor), ("critic", self.critic)):
            self.optimizers[name] = adam(network.parameters(), self.config.learning_rate)

    @property
    def modules(self) -> dict[str, nn.Module]:
        """Every network by its name in checkpoints."""
        return {"actor": self.actor, "critic": self.critic, "target": self.target}

    def start_from(self, other: SoftActorCritic) -> None:
        """Take over the networks of another learner, with new optimizers."""
        for name, network in self.modules.items():
            network.load_state_dict(other.modules[name].state_dict())
        self._make_optimizers()

    def update(self, batch: Transitions, rng: np.random.Generator) -> dict[str, float]:
        """Take one gradient step of critics, actor and targets on control steps `batch` (m of them)."""
        seen = {name: torch.from_numpy(array) for name, array in vars(batch).items()}
        noise = rng.standard_normal((2, len(batch), self.actor.size), dtype=np.float32)
        later, now = torch.from_numpy(noise)
        error = self.critic_loss(seen, later)
        self._step("critic", error, self.critic)
        control, log_prob = self.actor.sample(seen["observation"], now)
        value = self.critic(seen["observation"], control).amin(0).mean()
        entropy = -log_prob.mean()
        self._step("actor", -value - self.config.temperature * entropy, self.actor)
        with torch.no_grad():
            for slow, fast in zip(self.target.parameters(), self.critic.parameters(), strict=True):
                slow.lerp_(fast, self.config.target_rate)
        found = {"critic_loss": error, "value": value, "entropy": entropy}
        return {name: float(number.detach()) for name, number in found.items()}

    def critic_loss(self, seen: Mapping[str, Tensor], noise: Tensor) -> Tensor:
        """Return the critics' squared error () from the soft value of the next state; the time limit is bootstrapped.

        Args:
            seen: control steps by the names of `Transitions`.
            noise: standard-normal (m, C), for the controls of the next states.
        """
        following = seen["next_observation"]
        with torch.no_grad():
            control, log_prob = self.actor.sample(following, noise)
            value = self.target(following, control).amin(0) - self.config.temperature * log_prob
            target = seen["reward"] + self.config.gamma * ~seen["terminated"] * value
        values = self.critic(seen["observation"], seen["control"])
        return ((values - target) ** 2).mean(1).sum()

    def _step(self, name: str, loss: Tensor, network: nn.Module) -> None:
        self.optimizers[name].zero_grad(set_to_none=True)
        parameters = list(_trained(network))
        loss.backward(inputs=parameters)  # The actor's loss has slopes in the critics, too, which nobody needs.
        nn.utils.clip_grad_value_(parameters, LARGEST_SLOPE)
        self.optimizers[name].step()


def _trained(network: nn.Module) -> Iterator[nn.Parameter]:
    return (parameter for parameter in network.parameters() if parameter.requires_grad)
