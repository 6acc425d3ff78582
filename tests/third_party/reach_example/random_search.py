"""Random search over linear policies: try a neighbour of the best policy so far, and keep it if its return is higher.

Shapes: `B` batch (may be absent), `O` observation, `D` design, `C` control, `G` goal, `S` state, `W` all weights.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from codesign_bench.config.search import Integer, LogUniform
from codesign_bench.method import Array, BatchReport, Method, Policy, Problem, State
from codesign_bench.seeding import Streams
from codesign_bench.task import Floats, Singles, Task


@dataclass(frozen=True)
class Config:
    """Hyperparameters of the search."""

    batch_size: int = field(default=500, metadata={"search": Integer(100, 2_000, log=True)})
    """Environment steps spent on one candidate."""
    practice: int = field(default=16, metadata={"search": Integer(1, 64, log=True)})
    """Number of instances for all candidates, in turn: new instances for each would reward luck."""
    step_size: float = field(default=0.3, metadata={"search": LogUniform(0.03, 1.0)})
    """Standard deviation of a candidate's distance from the best policy, per weight."""


class RandomSearch(Method[Config]):
    """Keeps the best of random linear policies. All are evaluated on the same few instances."""

    name = "random_search"
    label = "Random search"
    config_class = Config

    def __init__(self, problem: Problem, config: Config, streams: Streams) -> None:
        super().__init__(problem, config, streams)
        self.best: Floats = np.zeros(_LinearPolicy.count_weights(problem.task))
        self.best_return: float | None = None
        self.instances = problem.sample_instances(streams["instances"], config.practice)

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Mapping[str, tuple[Any, str]]:
        """Return no settings: the defaults are used for every profile and task."""
        return {}

    def train(self, remaining_steps: int) -> BatchReport:
        """Judge one candidate on whole episodes and keep it if it is the best so far; the first is the start itself."""
        noise = self.streams["candidates"].standard_normal(self.best.shape)
        candidate = self.best if self.best_return is None else self.best + self.config.step_size * noise
        policy = _LinearPolicy(self.problem.task, candidate)
        env_steps, mean_return = self._judge(policy, min(self.config.batch_size, remaining_steps))
        if self.best_return is None or mean_return > self.best_return:
            self.best, self.best_return = candidate, mean_return
        return BatchReport(env_steps, {"candidate_return": mean_return, "best_return": self.best_return})

    def policy(self) -> Policy:
        """Return the best policy so far."""
        return _LinearPolicy(self.problem.task, self.best)

    @classmethod
    def make_policy(cls, task: Task, config: Config, tensors: Mapping[str, Array]) -> Policy:
        """Return the policy with the weights of `tensors`."""
        return _LinearPolicy(task, np.asarray(tensors["weights"], dtype=np.float64))

    def state(self) -> State:
        """Return the best weights and their return."""
        return State({"best": self.best}, {"best_return": self.best_return})

    def load_state(self, state: State) -> None:
        """Resume from `state`."""
        self.best, self.best_return = state.arrays["best"], state.values["best_return"]

    def _judge(self, policy: Policy, target: int) -> tuple[int, float]:
        """Run just enough whole episodes for `target` environment steps; return the steps and the mean return."""
        env_steps, returns = 0, np.zeros(0)
        while env_steps < target:
            # The fewest episodes that could fill the remaining steps, all at full length: none is played in vain.
            count = -(-(target - env_steps) // (self.problem.task.horizon + 1))
            chosen = np.arange(len(returns), len(returns) + count) % len(self.instances)
            lengths, wave = self._roll_out(policy, self.instances[chosen])
            env_steps += int(lengths.sum())
            returns = np.concatenate([returns, wave])
        return env_steps, float(returns.mean())

    def _roll_out(self, policy: Policy, instances: Floats) -> tuple[Floats, Floats]:
        """Run an episode of each instance (b, I); return lengths, including the design step, and returns, (b,) each."""
        running, lengths, returns = np.arange(len(instances)), np.ones(len(instances)), np.zeros(len(instances))
        with self.problem.episodes(len(instances)) as episodes:
            episodes.begin(running, instances)
            episodes.design(running, policy.design(episodes.observation[running]).astype(np.float64))
            while running.size:
                controls = policy.act(episodes.observation[running]).astype(np.float64)
                reward, terminated, truncated = episodes.control(running, controls)
                returns[running] += reward
                lengths[running] += 1
                running = running[~(terminated | truncated)]
        return lengths, returns


class _LinearPolicy(Policy):
    """Design linear in the goal, control linear in state and goal; both through tanh, inputs scaled to [-1, 1]."""

    def __init__(self, task: Task, weights: Floats) -> None:
        self.task = task
        self.weights = weights
        goal, state = task.goal_size, task.state_space.size
        split = (goal + 1) * task.design_space.size
        self.designer = weights[:split].reshape(goal + 1, -1)
        self.controller = weights[split:].reshape(goal + state + 1, -1)

    @staticmethod
    def count_weights(task: Task) -> int:
        """Return W."""
        goal, state = task.goal_size, task.state_space.size
        return (goal + 1) * task.design_space.size + (goal + state + 1) * task.control_space.size

    def design(self, observation: Singles) -> Singles:
        """Return the design (D,) or (B, D) for an observation (O,) or (B, O)."""
        return self._squash(self._goal(observation), self.designer)

    def act(self, observation: Singles) -> Singles:
        """Return the control (C,) or (B, C) for an observation (O,) or (B, O)."""
        state = self.task.state_space.to_unit(observation[..., self.task.layout.state])
        return self._squash(np.concatenate([self._goal(observation), state], axis=-1), self.controller)

    def tensors(self) -> dict[str, Array]:
        """Return the weights (W,)."""
        return {"weights": self.weights}

    def _goal(self, observation: Singles) -> Floats:
        return self.task.goal_space.to_unit(observation[..., self.task.layout.goal])

    @staticmethod
    def _squash(inputs: Floats, matrix: Floats) -> Singles:
        return np.tanh(inputs @ matrix[:-1] + matrix[-1]).astype(np.float32)
