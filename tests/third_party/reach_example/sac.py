"""Soft actor-critic (Haarnoja et al. 2018) on the two-phase episode: a learner that is not PPO.

The design step is a transition in the replay buffer whose action is a design. Actions of both phases share one vector
[design | control], in which the other phase's part is zero.

Shapes: `m` transitions of a minibatch, `b` slots, `O` observation, `F` features, `D` design, `C` control, `A` = D + C.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from codesign_bench.config.search import Choice, Integer, LogUniform
from codesign_bench.learning.batches import BatchCollector
from codesign_bench.learning.checkpointing import learner_arrays, load_learner_arrays, load_module_arrays
from codesign_bench.learning.explorer import Explorer, Sample
from codesign_bench.learning.features import Features
from codesign_bench.learning.network_policy import NetworkPolicy
from codesign_bench.learning.networks import MLP, RunningNorm, torch_generator
from codesign_bench.learning.optimizers import adam
from codesign_bench.learning.replay import ReplayBuffer, Transitions
from codesign_bench.method import Array, BatchReport, Method, Policy, Problem, State
from codesign_bench.seeding import Streams
from codesign_bench.task import Singles, Slots, Task


@dataclass(frozen=True, kw_only=True)
class Config:
    """Hyperparameters of `sac`."""

    batch_size: int = 1_000
    """Environment steps between two rounds of updates; episodes are finished."""
    updates_per_step: float = field(default=0.25, metadata={"search": LogUniform(0.05, 0.5)})
    """Gradient steps per environment step."""
    minibatch_size: int = field(default=256, metadata={"search": Integer(64, 512, log=True)})
    """Transitions per gradient step."""
    replay_size: int = 100_000
    """Capacity of the replay buffer, transitions."""
    learning_rate: float = field(default=3e-3, metadata={"search": LogUniform(3e-4, 1e-2)})
    """Adam's learning rate for actor, critics and temperatures."""
    gamma: float = field(default=0.95, metadata={"search": Choice((0.9, 0.95, 0.98, 0.99))})
    """Discount factor per step."""
    target_rate: float = field(default=0.02, metadata={"search": LogUniform(3e-3, 0.1)})
    """Fraction by which target networks move towards their critics in each step."""
    temperature: float = field(default=0.03, metadata={"search": LogUniform(3e-3, 0.3)})
    """Initial weight of the entropy, for designs and for controls; both are adapted."""
    hidden: tuple[int, ...] = (64, 64)
    """Widths of the hidden layers of actor and critics."""


class SquashedActor(nn.Module):
    """tanh of a Gaussian over [design | control], whose mean and deviation depend on the observation."""

    LOG_STD = (-5.0, 1.0)

    def __init__(self, task: Task, hidden: tuple[int, ...], rng: np.random.Generator) -> None:
        super().__init__()
        self.features = Features(task)
        self.norm = RunningNorm.over(*self.features.boxes)  # never updated: scales by the bounds of the spaces
        self.sizes = [task.design_space.size, task.control_space.size]
        self.mlp = MLP([self.features.flat_size, *hidden, 2 * sum(self.sizes)], torch_generator(rng), output_scale=0.1)

    def forward(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean and log standard deviation, (m, A) each, before squashing, for observations (m, O)."""
        mean, log_std = self.mlp(self.features.flat(observation, self.norm)).chunk(2, dim=1)
        return mean, log_std.clamp(*self.LOG_STD)

    def design(self, observation: Tensor) -> Tensor:
        """Return the mean designs (m, D), squashed."""
        return torch.tanh(self(observation)[0]).split(self.sizes, dim=1)[0]

    def control(self, observation: Tensor) -> Tensor:
        """Return the mean controls (m, C), squashed."""
        return torch.tanh(self(observation)[0]).split(self.sizes, dim=1)[1]

    def sample(self, observation: Tensor, noise: Tensor) -> tuple[Tensor, Tensor]:
        """Return actions (m, A) drawn with `noise` (m, A), zero in the other phase, and log-probabilities (m,)."""
        mean, log_std = self(observation)
        mask = self.mask(observation)
        action = torch.tanh(mean + log_std.exp() * noise)
        log_prob = -0.5 * noise**2 - log_std - 0.5 * math.log(2.0 * math.pi) - torch.log(1.0 - action**2 + 1e-6)
        return action * mask, (log_prob * mask).sum(1)

    def mask(self, observation: Tensor) -> Tensor:
        """Return (m, A): 1 for entries of the action that count in the observation's phase, else 0."""
        return self.features.phase(observation).repeat_interleave(torch.tensor(self.sizes), dim=1)


class TwinCritic(nn.Module):
    """Two value networks for actions; the smaller of their values is used."""

    def __init__(self, actor: SquashedActor, hidden: tuple[int, ...], rng: np.random.Generator) -> None:
        super().__init__()
        self.features, self.norm = actor.features, actor.norm
        sizes = [self.features.flat_size + sum(actor.sizes), *hidden, 1]
        self.networks = nn.ModuleList(MLP(sizes, torch_generator(rng)) for _ in range(2))

    def forward(self, observation: Tensor, action: Tensor) -> Tensor:
        """Return both values (2, m) of actions (m, A) for observations (m, O)."""
        inputs = torch.cat([self.features.flat(observation, self.norm), action], dim=1)
        return torch.stack([network(inputs)[:, 0] for network in self.networks])


class _SquashedExplorer(Explorer):
    """Samples the actor; only the actions are stored."""

    def __init__(self, actor: SquashedActor) -> None:
        super().__init__(sum(actor.sizes), sum(actor.sizes))
        self.actor = actor

    def sample_design(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Return designs drawn with `noise` (b, A)."""
        return Sample(self._sample(observation, noise)[:, : self.actor.sizes[0]])

    def sample_control(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Return controls drawn with `noise` (b, A)."""
        return Sample(self._sample(observation, noise)[:, self.actor.sizes[0] :])

    def _sample(self, observation: Singles, noise: Singles) -> Singles:
        with torch.inference_mode():
            actions: Singles = self.actor.sample(torch.from_numpy(observation), torch.from_numpy(noise))[0].numpy()
        return actions


class Sac(Method[Config]):
    """Soft actor-critic with twin critics and a temperature for each phase, adapted to an entropy of -D and -C."""

    name = "sac"
    label = "SAC"
    config_class = Config

    def __init__(self, problem: Problem, config: Config, streams: Streams) -> None:
        super().__init__(problem, config, streams)
        self.actor = SquashedActor(problem.task, config.hidden, streams["actor weights"])
        self.critic = TwinCritic(self.actor, config.hidden, streams["critic weights"])
        self.target = TwinCritic(self.actor, config.hidden, streams["target weights"])
        self.target.load_state_dict(self.critic.state_dict())
        self.temperature = nn.ParameterList([torch.full((2,), math.log(config.temperature))])
        self.optimizers = {name: adam(module.parameters(), config.learning_rate) for name, module in self._learned()}
        self.buffer = ReplayBuffer(config.replay_size, problem.task)
        self.collector = BatchCollector(problem, streams)

    def _learned(self) -> list[tuple[str, nn.Module]]:
        return [("actor", self.actor), ("critic", self.critic.networks), ("temperature", self.temperature)]

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Mapping[str, tuple[Any, str]]:
        """Return no settings: the defaults are used for every profile and task."""
        return {}

    def use_cores(self, count: int) -> None:
        """Play episodes in up to `count` processes."""
        self.collector.use_cores(count)

    @classmethod
    def small(cls) -> Mapping[str, Any]:
        """Return batches of a few episodes and small networks."""
        return {
            "batch_size": 250,
            "minibatch_size": 32,
            "updates_per_step": 0.02,
            "replay_size": 2_000,
            "hidden": (16,),
        }

    def train(self, remaining_steps: int) -> BatchReport:
        """Collect a batch of whole episodes, then update on minibatches of the replay buffer."""
        batch = self.collector.collect(_SquashedExplorer(self.actor), min(self.config.batch_size, remaining_steps))
        self.buffer.add(Transitions.of(batch))
        updates = max(1, round(self.config.updates_per_step * batch.env_steps))
        losses = [self._update() for _ in range(updates)]
        metrics = {name: float(np.mean([loss[name] for loss in losses])) for name in losses[0]}
        return BatchReport(batch.env_steps, batch.summary() | metrics, updates)

    def _update(self) -> dict[str, float]:
        """Take one gradient step of critics, actor and temperatures."""
        rng, count = self.streams["updates"], self.config.minibatch_size
        batch = {name: torch.from_numpy(array) for name, array in vars(self.buffer.sample(count, rng)).items()}
        now, later = torch.from_numpy(rng.standard_normal((2, count, sum(self.actor.sizes)), dtype=np.float32))
        critic_loss = self._critic_loss(batch, later)
        self._step("critic", critic_loss)
        action, log_prob = self.actor.sample(batch["observation"], now)
        temperature = self._temperature(batch["observation"])
        value = self.critic(batch["observation"], action).amin(0)
        self._step("actor", (temperature.detach() * log_prob - value).mean())
        surplus = log_prob.detach() - self.actor.mask(batch["observation"]).sum(1)  # target entropy: -D or -C
        self._step("temperature", -(temperature.log() * surplus).mean())
        with torch.no_grad():
            for slow, fast in zip(self.target.networks.parameters(), self.critic.networks.parameters(), strict=True):
                slow.lerp_(fast, self.config.target_rate)
        found = {"critic_loss": critic_loss, "entropy": -log_prob.mean(), "value": value.mean()}
        return {name: number.item() for name, number in found.items()}

    def _critic_loss(self, batch: Mapping[str, Tensor], noise: Tensor) -> Tensor:
        """Return the critics' squared error () from the next state's soft value; the time limit is bootstrapped."""
        following = batch["next_observation"]
        with torch.no_grad():
            action, log_prob = self.actor.sample(following, noise)
            value = self.target(following, action).amin(0) - self._temperature(following) * log_prob
            target = batch["reward"] + self.config.gamma * ~batch["terminated"] * value
        values = self.critic(batch["observation"], torch.cat([batch["design"], batch["control"]], dim=1))
        return ((values - target) ** 2).mean(1).sum()

    def _temperature(self, observation: Tensor) -> Tensor:
        """Return the temperature (m,) of the phase of each observation (m, O)."""
        return (self.actor.features.phase(observation) @ self.temperature[0]).exp()

    def _step(self, name: str, loss: Tensor) -> None:
        self.optimizers[name].zero_grad()
        loss.backward()
        self.optimizers[name].step()

    def policy(self) -> Policy:
        """Return the actor acting with its squashed means."""
        return NetworkPolicy(self.actor, self.actor.design, self.actor.control)

    @classmethod
    def make_policy(cls, task: Task, config: Config, tensors: Mapping[str, Array]) -> Policy:
        """Return the actor with the parameters of `tensors`."""
        actor = SquashedActor(task, config.hidden, np.random.default_rng(0))
        load_module_arrays(actor, tensors)
        return NetworkPolicy(actor, actor.design, actor.control)

    def state(self) -> State:
        """Return networks and optimizers, and the replay buffer as large state."""
        return State(learner_arrays(self._modules(), self.optimizers), {}, self.buffer.arrays())

    def load_state(self, state: State) -> None:
        """Resume from `state`."""
        load_learner_arrays(self._modules(), self.optimizers, state.arrays)
        self.buffer.load(state.large)

    def _modules(self) -> dict[str, nn.Module]:
        return {**dict(self._learned()), "target": self.target.networks}
