"""The two-phase learner: PPO on whole episodes of one design step and many control steps.

Shapes: `S` slots, `T` steps, `n` valid steps of a batch, `d` its design steps, `O` observation.

The design step's credit is a switch. `joint`, the paper's: it is one more step of the episode, with the discounted
advantage of every other step, in the same minibatches. `separate` (ours, after the temporal credit assignment of
BodyGen, 2025): its advantage is the undiscounted return minus a value of its own, normalised apart, with its own
updates and its own KL stop.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from codesign_bench.learning.actor import Actor, ActorPolicy
from codesign_bench.learning.checkpointing import learner_arrays, load_learner_arrays
from codesign_bench.learning.gae import episode_returns, generalized_advantages
from codesign_bench.learning.ppo import (
    PolicyLoss,
    PolicyUpdate,
    Update,
    ValueUpdate,
    gaussian,
    minibatches,
    normalized,
)
from codesign_bench.learning.ppo_config import PPOConfig
from codesign_bench.learning.rollout import Collector, Trajectories, group_sizes, joined, slots_for
from codesign_bench.learning.rollout_pool import Group, RolloutPool
from codesign_bench.learning.value_networks import DesignValue, ValueNetwork
from codesign_bench.method import BatchReport, Policy, Problem, State
from codesign_bench.seeding import Streams
from codesign_bench.task import Singles, Slots

CPU = torch.device("cpu")
BLOCK = 64
"""Rows of observations come in multiples of this where products are compiled for their shape (ours)."""

ChooseDesigns = Callable[[Slots], Singles]
"""Maps slots (b,) to the designs (b, D) of all their episodes in the batch to come."""

Distribution = Callable[[Tensor], tuple[Tensor, Tensor]]
"""Maps observations (m, O) to mean (m, A) and log standard deviation (A,) of actions."""


class TwoPhaseLearner:
    """Collects batches with an actor and improves it by PPO; methods differ in the networks that they hand in."""

    def __init__(
        self,
        problem: Problem,
        config: PPOConfig,
        streams: Streams,
        actor: Actor,
        value: ValueNetwork,
        choose_designs: ChooseDesigns | None = None,
    ) -> None:
        self.problem, self.config, self.streams = problem, config, streams
        self.actor, self.value, self.choose_designs = actor, value, choose_designs
        self.separate = config.design_credit == "separate" and choose_designs is None
        self.design_value = DesignValue(problem.task, streams["design value weights"])
        control = actor.control_parameters()
        if not self.separate and choose_designs is None:
            known = {id(p) for p in control}
            control = control + [p for p in actor.design_parameters() if id(p) not in known]
        self.optimizers: dict[str, torch.optim.Adam] = {
            "policy": _adam(control, config.policy_learning_rate),
            "value": _adam(list(value.parameters()), config.value_learning_rate),
        }
        if self.separate:
            self.optimizers["design"] = _adam(actor.design_parameters(), config.design_learning_rate)
            self.optimizers["design_value"] = _adam(list(self.design_value.parameters()), config.value_learning_rate)
        self._start_rates = {name: optimizer.param_groups[0]["lr"] for name, optimizer in self.optimizers.items()}
        episode_steps = problem.task.horizon + 1
        self._episode_steps = episode_steps
        self.collector = Collector(problem)
        self.env_steps = 0
        self._device = CPU
        self._pool: RolloutPool | None = None
        self._threads: ThreadPoolExecutor | None = None

    def use_cores(self, count: int) -> None:
        """Use up to `count` cores: rollouts in processes, policy and value update in threads; no number changes."""
        if count > 1:
            self._pool = RolloutPool(self.problem, count)
            self._threads = ThreadPoolExecutor(2, initializer=torch.set_num_threads, initargs=(1,))

    def policy(self) -> Policy:
        """Return the actor acting with its means."""
        return ActorPolicy(self.actor)

    def train(self, remaining_steps: int) -> tuple[BatchReport, Trajectories]:
        """Collect one batch and learn from it."""
        config = self.config
        steps = min(config.batch_size, remaining_steps)
        slots = slots_for(steps, config.batch_size, self._episode_steps, config.num_slots)
        self._anneal(remaining_steps)
        batch = self.collect(steps, slots)
        self.env_steps += batch.env_steps
        metrics = batch.summary() | self.update(batch)
        gradient_steps = int(metrics["policy_steps"] + metrics.get("design_steps", 0.0))
        return BatchReport(batch.env_steps, metrics, gradient_steps), batch

    def collect(self, steps: int, slots: int) -> Trajectories:
        """Return about `steps` environment steps of whole episodes, played in `slots` slots."""
        given = None if self.choose_designs is None else self.choose_designs(np.arange(slots))
        groups, start = [], 0
        for index, size in enumerate(group_sizes(slots, self.problem.task.max_slots)):
            stream = "rollout" if index == 0 else f"rollout {index}"
            own = None if given is None else given[start : start + size]
            groups.append(Group(steps * size // slots, size, self.streams[stream], own))
            start += size
        if self._pool is not None and len(groups) > 1:
            return joined(self._pool.collect(self.actor, groups))
        return joined([group.collect(self.collector, self.actor) for group in groups])

    def _autocast(self) -> torch.autocast:
        """Return the context in which an update's networks run: products in the configured precision."""
        return torch.autocast(self._device.type, torch.bfloat16, enabled=self.config.precision == "bf16")

    def _distribution(self, phase: Distribution, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean (m, A) and log standard deviation (A,) of a phase's actions as the update computes them."""
        with self._autocast():
            mean, log_std = phase(observation)
        return mean.float(), log_std

    def _full_blocks(self, observation: Tensor) -> Tensor:
        """Return observations (m, O), in reduced precision with rows of zeros up to a multiple of `BLOCK`.

        The share of design steps differs between minibatches, and the library behind such products compiles and keeps a
        kernel for every number of rows: hundreds of megabytes.
        """
        missing = -len(observation) % BLOCK if self.config.precision == "bf16" else 0
        return nn.functional.pad(observation, (0, 0, 0, missing)) if missing else observation

    def _predict(self, observation: Tensor) -> Tensor:
        """Return the value network's output (m,) as the update computes it."""
        with self._autocast():
            values: Tensor = self.value(observation)
        return values.float()

    def use_device(self, name: str) -> None:
        """Update the networks on the device `name`, as torch calls it; rollouts stay on the processor."""
        self._device = torch.device(name)

    def _tensor(self, array: np.ndarray) -> Tensor:
        """Return an array as a tensor on the device of updates."""
        return torch.from_numpy(array).to(self._device)

    def _move(self, device: torch.device) -> None:
        """Bring networks and optimizers to a device."""
        for module in self.modules().values():
            module.to(device)
        for optimizer in self.optimizers.values():
            for values in optimizer.state.values():
                values.update({key: value.to(device) for key, value in values.items()})

    def update(self, batch: Trajectories) -> dict[str, float]:
        """Improve actor and value networks on a batch; return the logged values."""
        if self._device == CPU:
            return self._update(batch)
        self._move(self._device)
        try:
            return self._update(batch)
        finally:
            self._move(CPU)

    def _update(self, batch: Trajectories) -> dict[str, float]:
        valid = batch.valid
        observation = self._tensor(batch.observation[valid])
        is_design = self._tensor(batch.is_design[valid])
        advantage, target, explained = self._advantages(batch, observation)
        metrics = self._update_control(batch, observation, is_design, advantage, target)
        if self.separate:
            metrics |= self._update_design(batch)
        if self.config.normalize_observations:
            self.actor.update_statistics(observation, is_design)
            self.value.update_statistics(observation)
        return metrics | {"explained_variance": explained}

    def _advantages(self, batch: Trajectories, observation: Tensor) -> tuple[Tensor, Tensor, float]:
        """Return advantage and value target of the valid steps, each (n,), and the share of variance explained."""
        config, valid = self.config, batch.valid
        value = np.zeros(valid.shape)
        with torch.inference_mode():
            value[valid] = self._values(observation)
            next_value = np.zeros(valid.shape)
            next_value[:, :-1] = value[:, 1:]
            if config.bootstrap_time_limit and batch.truncated.any():
                final = self._tensor(batch.final_observation[batch.truncated])
                next_value[batch.truncated] = self._values(final)
        advantage = generalized_advantages(
            reward=batch.reward,
            value=value,
            next_value=next_value,
            terminated=batch.terminated if config.bootstrap_time_limit else batch.episode_end,
            episode_end=batch.episode_end,
            gamma=config.gamma,
            gae_lambda=config.gae_lambda,
        )
        returns = (advantage + value)[valid]
        explained = 1.0 - float(np.var(returns - value[valid]) / (np.var(returns) + 1e-12))
        target = self._tensor(returns.astype(np.float32))
        if config.normalize_returns:
            self.value.update_returns(target)
        return self._tensor(advantage[valid].astype(np.float32)), self.value.normalized(target), explained

    def _values(self, observation: Tensor) -> Singles:
        """Return the expected returns (B,) for observations (B, O), in parts that stay in the processor's cache."""
        parts = [self.value.denormalized(part) for part in observation.split(self.config.minibatch_size)]
        values: Singles = torch.cat(parts).cpu().numpy()
        return values

    def _update_control(
        self, batch: Trajectories, observation: Tensor, is_design: Tensor, advantage: Tensor, target: Tensor
    ) -> dict[str, float]:
        config, rng = self.config, self.streams["minibatches"]
        learned = torch.ones_like(is_design) if self._credit() == "joint" else ~is_design
        rows = torch.nonzero(learned)[:, 0].cpu().numpy()
        normal = torch.zeros_like(advantage)
        normal[learned] = normalized(advantage[learned])
        old_log_prob = self._tensor(batch.log_prob[batch.valid])
        log_probs = self._log_probs(batch, observation, is_design)
        if config.precision != "fp32":  # Ratios start at one only if both of their parts are rounded alike.
            with torch.no_grad():
                for part in np.array_split(rows, max(1, len(rows) // config.minibatch_size)):
                    old_log_prob[part] = log_probs(part)[0]
        policy = PolicyUpdate(
            self._loss(config.kl_threshold), log_probs, self.optimizers["policy"], old_log_prob, normal
        )
        value = ValueUpdate(self._predict, self.optimizers["value"], observation, target, config.max_gradient_norm)
        self._learn((policy, value), rows, config.epochs, config.minibatch_size, rng)
        return {"value_loss": value.loss, "kl": policy.divergence, "policy_steps": float(policy.steps)} | self._stds()

    def _update_design(self, batch: Trajectories) -> dict[str, float]:
        config, rng = self.config, self.streams["design minibatches"]
        where = batch.is_design & batch.valid
        observation = self._tensor(batch.observation[where])
        design = self._tensor(batch.design[where])
        returns = self._tensor(episode_returns(batch.reward, batch.episode_end)[where].astype(np.float32))
        if config.normalize_observations:
            self.design_value.update_statistics(observation)
        self.design_value.update_returns(returns)
        with torch.no_grad():
            advantage = normalized(returns - self.design_value.denormalized(observation))

        def log_probs(rows: Slots) -> tuple[Tensor, Tensor]:
            index = self._tensor(rows)
            mean, log_std = self.actor.design(observation[index])
            return gaussian(mean, log_std, design[index])

        old_log_prob = self._tensor(batch.log_prob[where])
        loss = self._loss(config.design_kl_threshold)
        policy = PolicyUpdate(loss, log_probs, self.optimizers["design"], old_log_prob, advantage)
        target = self.design_value.normalized(returns)
        value = ValueUpdate(
            self.design_value, self.optimizers["design_value"], observation, target, config.max_gradient_norm
        )
        rows = np.arange(len(returns))
        self._learn((policy, value), rows, config.design_epochs, config.design_minibatch_size, rng)
        return {"design_kl": policy.divergence, "design_steps": float(policy.steps), "design_value_loss": value.loss}

    def _learn(
        self, updates: Sequence[Update], rows: Slots, epochs: int, minibatch_size: int, rng: np.random.Generator
    ) -> None:
        """Make every update go over the same minibatches of `rows`, at once if there are cores: they share nothing."""
        parts = [rows[part] for _ in range(epochs) for part in minibatches(len(rows), minibatch_size, rng)]

        def learn(update: Update) -> None:
            for part in parts:
                update.step(part)

        if self._threads is None:
            for update in updates:
                learn(update)
        else:
            list(self._threads.map(learn, updates))

    def _log_probs(self, batch: Trajectories, observation: Tensor, is_design: Tensor) -> Any:
        """Return the function from rows to log-probabilities and entropy, over both phases under joint credit."""
        control = self._tensor(batch.control[batch.valid])
        design = self._tensor(batch.design[batch.valid])
        joint = self._credit() == "joint"

        def log_probs(rows: Slots) -> tuple[Tensor, Tensor]:
            index = self._tensor(rows)
            if not joint:
                return gaussian(*self._distribution(self.actor.control, observation[index]), control[index])
            designing = is_design[index]
            log_prob, entropy = observation.new_zeros(len(rows)), observation.new_zeros(())
            for phase, action, where in (
                (self.actor.control, control, ~designing),
                (self.actor.design, design, designing),
            ):
                if where.any():  # Few minibatches of few steps may hold no design step.
                    chosen = index[where]
                    mean, log_std = self._distribution(phase, self._full_blocks(observation[chosen]))
                    part, part_entropy = gaussian(mean[: len(chosen)], log_std, action[chosen])
                    log_prob = log_prob.masked_scatter(where, part)
                    entropy = entropy + where.float().mean() * part_entropy
            return log_prob, entropy

        return log_probs

    def _credit(self) -> str:
        """Return how the design step is learned here: `joint`, `separate`, or `none` when designs are given."""
        if self.choose_designs is not None:
            return "none"
        return "separate" if self.separate else "joint"

    def _loss(self, kl_threshold: float) -> PolicyLoss:
        config = self.config
        return PolicyLoss(config.clip_ratio, config.entropy_weight, kl_threshold, config.max_gradient_norm)

    def _stds(self) -> dict[str, float]:
        return {
            "control_std": float(self.actor.control_log_std.detach().exp().mean()),
            "design_std": float(self.actor.design_log_std.detach().exp().mean()),
        }

    def _anneal(self, remaining_steps: int) -> None:
        done = self.env_steps / (self.env_steps + remaining_steps)
        factor = 1.0 - done * (1.0 - self.config.final_learning_rate_fraction)
        for name, optimizer in self.optimizers.items():
            optimizer.param_groups[0]["lr"] = self._start_rates[name] * factor

    def modules(self) -> dict[str, nn.Module]:
        """Return every module with its name in checkpoints."""
        return {"actor": self.actor, "value": self.value, "design_value": self.design_value}

    def state(self) -> State:
        """Return parameters, normalisers, optimizers and the step count."""
        return State(learner_arrays(self.modules(), self.optimizers), {"env_steps": self.env_steps})

    def load_state(self, state: State) -> None:
        """Go on from `state`."""
        load_learner_arrays(self.modules(), self.optimizers, state.arrays)
        self.env_steps = int(state.values["env_steps"])


def _adam(parameters: list[nn.Parameter], learning_rate: float) -> torch.optim.Adam:
    return torch.optim.Adam([p for p in parameters if p.requires_grad], lr=learning_rate, fused=True)
