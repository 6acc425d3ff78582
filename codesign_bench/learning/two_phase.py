"""The two-phase learner: PPO on whole episodes of one design step and many control steps.

Shapes: `S` slots, `n` valid steps of a batch, `b` slots, `D` design.

The learner connects its parts: `BatchCollector` plays episodes, `Critic` estimates advantages, `DesignCredit` defines
how the design step is learned, `UpdateLoop` takes the gradient steps, `Compute` holds device and precision.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor, nn

from codesign_bench.learning.actor import Actor, ActorPolicy, GaussianExplorer
from codesign_bench.learning.batches import BatchCollector, most_steps, slots_for
from codesign_bench.learning.checkpointing import learner_arrays, load_learner_arrays
from codesign_bench.learning.compute import Compute
from codesign_bench.learning.credit import DesignCredit, JointCredit, NoCredit, SeparateCredit, Steps
from codesign_bench.learning.critic import Critic, Estimates
from codesign_bench.learning.explorer import Explorer
from codesign_bench.learning.fixed_updates import Batch, FixedPolicyUpdate, FixedUpdates, FixedValueUpdate
from codesign_bench.learning.optimizers import Annealing, adam
from codesign_bench.learning.ppo import LogProbs, PolicyLoss, PolicyUpdate, ValueUpdate, normalized
from codesign_bench.learning.ppo_config import PPOConfig
from codesign_bench.learning.trajectories import Trajectories
from codesign_bench.learning.update_loop import UpdateLoop, drawn
from codesign_bench.learning.value_networks import ValueNetwork
from codesign_bench.method import BatchReport, Policy, Problem, State
from codesign_bench.seeding import Streams
from codesign_bench.task import Slots

GiveDesigns = Callable[[Explorer, int, int], tuple[Explorer, int]]
"""Maps the actor's explorer, and the steps and the number of slots of the batch to come, to an explorer that chooses
the designs in the actor's place, and to the number of slots, which may be smaller."""


class TwoPhaseLearner:
    """Collects batches with an actor and trains it by PPO; methods differ in the networks that they pass in."""

    def __init__(
        self,
        problem: Problem,
        config: PPOConfig,
        streams: Streams,
        actor: Actor,
        value: ValueNetwork,
        give_designs: GiveDesigns | None = None,
        loop: UpdateLoop | None = None,
    ) -> None:
        self.problem, self.config, self.streams = problem, config, streams
        self.actor, self.value, self.give_designs = actor, value, give_designs
        self.collector = BatchCollector(problem, streams)
        self.compute = Compute(config.precision)
        self.loop = loop or UpdateLoop()
        self.critic = Critic(value, config, self.compute)
        self.credit = self.make_credit()
        self.optimizers: dict[str, torch.optim.Optimizer] = {
            "policy": adam(self.credit.policy_parameters(), config.policy_learning_rate),
            "value": adam(value.parameters(), config.value_learning_rate),
            **self.credit.optimizers,
        }
        self.annealing = Annealing(self.optimizers, config.final_learning_rate_fraction)
        self.fixed: FixedUpdates | None = None
        self.env_steps = 0

    def make_credit(self) -> DesignCredit:
        """Return how the design step is learned."""
        if self.give_designs is not None:
            return NoCredit(self.actor, self.compute)
        if self.config.design_credit == "joint":
            return JointCredit(self.actor, self.compute)
        task = self.problem.task
        return SeparateCredit(task, self.config, self.streams, self.actor, self.compute, self.loop)

    def use_cores(self, count: int) -> None:
        """Use up to `count` cores: rollouts in processes, policy and value updates in threads; same results."""
        self.collector.use_cores(count)
        self.loop.use_cores(count)

    def use_device(self, name: str) -> None:
        """Update the networks on torch's device `name`; rollouts stay on the CPU."""
        self.compute.use_device(torch.device(name))
        self.fixed = self._make_fixed() if self.compute.device.type == "cuda" else None

    def _make_fixed(self) -> FixedUpdates:
        """Return updates that a GPU can replay."""
        config, optimizers = self.config, self.optimizers
        loss = PolicyLoss.of(config, config.kl_threshold)
        return FixedUpdates(
            FixedPolicyUpdate(self.credit, optimizers["policy"], loss, self.compute),
            FixedValueUpdate(self.value, optimizers["value"], config.max_gradient_norm, self.compute),
        )

    def policy(self) -> Policy:
        """Return the actor acting with its means."""
        return ActorPolicy(self.actor)

    def train(self, remaining_steps: int) -> tuple[BatchReport, Trajectories]:
        """Collect one batch and learn from it."""
        steps = min(self.config.batch_size, remaining_steps)
        slots = slots_for(steps, self.problem.task.horizon + 1, self.config.num_slots)
        # From the steps taken and left instead of a counter of batches: batches vary in length, and a resumed cell
        # continues at the same place.
        self.annealing.set(self.env_steps / (self.env_steps + remaining_steps))
        batch = self.collect(steps, slots, most_steps(self.env_steps, remaining_steps))
        self.env_steps += batch.env_steps
        metrics = batch.summary() | self.update(batch)
        gradient_steps = int(metrics["policy_steps"] + metrics.get("design_steps", 0.0))
        return BatchReport(batch.env_steps, metrics, gradient_steps), batch

    def collect(self, steps: int, slots: int, most: int | None = None) -> Trajectories:
        """Return about `steps` environment steps of whole episodes, in at most `slots` slots; see `BatchCollector`."""
        explorer: Explorer = GaussianExplorer(self.actor)
        if self.give_designs is not None:
            explorer, slots = self.give_designs(explorer, steps, slots)
        return self.collector.collect(explorer, steps, slots, most)

    def update(self, batch: Trajectories) -> dict[str, float]:
        """Update actor and value networks on a batch; return the logged values."""
        with self.compute.holding(self.modules(), self.optimizers):
            return self._update(batch)

    def _update(self, batch: Trajectories) -> dict[str, float]:
        steps = Steps.of(batch, self.compute)
        estimates = self.critic.estimate(batch, steps.observation)
        advantage = self._advantage(steps, estimates)
        metrics = self.credit.lead(batch, steps, advantage)
        metrics |= self._update_policy_and_value(steps, advantage, estimates.target) | self._stds()
        # The design step may have its own updates. Observation statistics come last: ratios compare the new policy with
        # the log-probabilities of the rollout, which used the old statistics.
        metrics |= self.credit.learn(batch)
        if self.config.normalize_observations:
            self.actor.update_statistics(steps.observation, steps.is_design)
            self.value.update_statistics(steps.observation)
        return metrics | {"explained_variance": estimates.explained_variance}

    def _advantage(self, steps: Steps, estimates: Estimates) -> Tensor:
        """Return advantages (n,), normalised over the steps that the batch's policy update learns from, else zero."""
        # Design steps, few and with a different spread, must not shift the scale when they have their own update.
        learned = self.compute.tensor(np.flatnonzero(self.credit.learned(steps.designing)))
        advantage = torch.zeros_like(estimates.advantage)
        advantage[learned] = normalized(estimates.advantage[learned])
        return advantage

    def _update_policy_and_value(self, steps: Steps, advantage: Tensor, target: Tensor) -> dict[str, float]:
        config, optimizers = self.config, self.optimizers
        rows = np.flatnonzero(self.credit.learned(steps.designing))
        log_probs = self.credit.log_probs(steps)
        old_log_prob = self._old_log_prob(steps, log_probs, rows)
        first = steps.designing[rows] if config.batch_design else None
        drawing = (rows, config.epochs, config.minibatch_size, self.streams["minibatches"], first)
        if self.fixed is not None:
            return self.fixed.run(Batch(steps, old_log_prob, advantage, target), drawn(*drawing))
        loss = PolicyLoss.of(config, config.kl_threshold)
        policy = PolicyUpdate(loss, log_probs, optimizers["policy"], old_log_prob, advantage)
        value = ValueUpdate(self._predict, optimizers["value"], steps.observation, target, config.max_gradient_norm)
        self.loop.run((policy, value), *drawing)
        return {"value_loss": value.loss, "kl": policy.divergence, "policy_steps": float(policy.steps)}

    def _old_log_prob(self, steps: Steps, log_probs: LogProbs, rows: Slots) -> Tensor:
        """Return the log-probabilities (n,) in the denominator of ratios: those of the rollout, in single precision.

        In reduced precision they are recomputed: ratios start at one only if both terms are rounded alike.
        """
        if not self.compute.reduced:
            return steps.log_prob
        result = steps.log_prob.clone()
        with torch.no_grad():
            for part in np.array_split(rows, max(1, len(rows) // self.config.minibatch_size)):
                result[part] = log_probs(part)[0]
        return result

    def _predict(self, observation: Tensor) -> Tensor:
        return self.compute.predict(self.value, observation)

    def _stds(self) -> dict[str, float]:
        return {
            "control_std": float(self.actor.control_log_std.detach().exp().mean()),
            "design_std": float(self.actor.design_log_std.detach().exp().mean()),
        }

    def modules(self) -> dict[str, nn.Module]:
        """Return every module with its name in checkpoints."""
        return {"actor": self.actor, "value": self.value, **self.credit.modules}

    def state(self) -> State:
        """Return parameters, normalisers, optimizers and the step count."""
        return State(learner_arrays(self.modules(), self.optimizers), {"env_steps": self.env_steps})

    def load_state(self, state: State) -> None:
        """Resume from `state`."""
        load_learner_arrays(self.modules(), self.optimizers, state.arrays)
        self.env_steps = int(state.values["env_steps"])
