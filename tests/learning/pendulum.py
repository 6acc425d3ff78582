"""Gymnasium's Pendulum-v1 as a task, and the PPO core's settings for it, to compare the core with another's.

The design is one number without effect, which is given, so that PPO learns control alone. The physics are Gymnasium's
own, one environment per slot.

Shapes: `b` slots that a call names, `I` = 2 instance (angle, angular velocity), `D` = 1, `C` = 1.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import torch

from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.learning.two_phase import TwoPhaseLearner
from codesign_bench.method import Problem, load_method
from codesign_bench.seeding import Streams
from codesign_bench.task import Box, Floats, Simulator, Slots, Task, ToolGraph

ENVIRONMENT = "Pendulum-v1"
MAX_TORQUE = 2.0
BUDGET = 100_000

ENVIRONMENTS = 4
"""That stable-baselines3 steps side by side."""
STABLE_BASELINES3: dict[str, Any] = {
    "n_steps": 1024,
    "batch_size": 64,
    "n_epochs": 10,
    "learning_rate": 1e-3,
    "gamma": 0.9,
    "gae_lambda": 0.95,
    "clip_range": 0.2,
    "max_grad_norm": 0.5,
    "ent_coef": 0.0,
}
"""stable-baselines3's hyperparameters; its networks have two tanh layers of 64."""

OURS: dict[str, Any] = {
    "batch_size": ENVIRONMENTS * STABLE_BASELINES3["n_steps"],
    "minibatch_size": STABLE_BASELINES3["batch_size"],
    "epochs": STABLE_BASELINES3["n_epochs"],
    "policy_learning_rate": STABLE_BASELINES3["learning_rate"],
    "value_learning_rate": STABLE_BASELINES3["learning_rate"],
    "gamma": STABLE_BASELINES3["gamma"],
    "gae_lambda": STABLE_BASELINES3["gae_lambda"],
    "clip_ratio": STABLE_BASELINES3["clip_range"],
    "max_gradient_norm": STABLE_BASELINES3["max_grad_norm"],
    "entropy_weight": STABLE_BASELINES3["ent_coef"],
    "kl_threshold": 1e6,
    "control_log_std": math.log(1.0 / MAX_TORQUE),
    "fix_std": False,
    "policy_net": (64, 64),
    "value_net": (64, 64),
    "final_learning_rate_fraction": 1.0,
    "bootstrap_time_limit": True,
}
"""The same settings in this project's words.

The other's initial deviation of 1 is in N m, ours in units of the largest torque.
"""


class Pendulum(Task):
    """Swing a pendulum up and keep it there; 200 steps, which no success ends."""

    name = "pendulum"
    title = "Pendulum"
    horizon = 200
    control_period = 0.05
    design_space = Box.of(nothing=(-1.0, 1.0, "1"))
    tool_graph = ToolGraph(num_nodes=1, edges=(), parameter_nodes=(0,))
    control_space = Box.of(torque=(-MAX_TORQUE, MAX_TORQUE, "N m"))
    instance_space = Box.of(angle=(-np.pi, np.pi, "rad"), angular_velocity=(-1.0, 1.0, "rad/s"))
    goal_size = 0
    state_space = Box.of(cosine=(-1.0, 1.0, "1"), sine=(-1.0, 1.0, "1"), angular_velocity=(-8.0, 8.0, "rad/s"))

    def material(self, designs: Floats) -> Floats:
        """Nothing is used."""
        return np.zeros(len(designs))

    def effort(self, controls: Floats) -> Floats:
        """The torque over the largest."""
        return np.abs(controls[:, 0])

    def make_simulator(self, num_slots: int) -> Simulator:
        """Return Gymnasium's pendulums."""
        return _Pendulums(num_slots)


class _Pendulums(Simulator):
    def __init__(self, num_slots: int) -> None:
        super().__init__(num_slots, state_size=3)
        self._environments: list[Any] = [gymnasium.make(ENVIRONMENT).unwrapped for _ in range(num_slots)]

    def begin(self, slots: Slots, instances: Floats) -> None:
        """Let go of the pendulums at their angles and velocities."""
        for slot, instance in zip(slots, instances, strict=True):
            self._environments[slot].reset(seed=0)  # What it draws is replaced by the instance.
            self._environments[slot].state = instance.copy()
        self.state[slots] = np.stack([np.cos(instances[:, 0]), np.sin(instances[:, 0]), instances[:, 1]], axis=1)

    def build(self, slots: Slots, designs: Floats) -> None:
        """Build nothing."""

    def step(self, slots: Slots, controls: Floats) -> None:
        """Apply the torques."""
        for slot, control in zip(slots, controls, strict=True):
            self.state[slot], self.reward[slot], *_ = self._environments[slot].step(MAX_TORQUE * control)


def make_learner(seed: int, normalize_observations: bool) -> TwoPhaseLearner:
    """Return the PPO core with the perceptrons of `shared_arch` and a given design, so that it learns control alone."""
    method_class: Any = load_method("shared_arch")
    problem, streams = Problem(Pendulum()), Streams(seed)
    config = replace(method_class.config_class(), **OURS, normalize_observations=normalize_observations)
    actor = method_class.make_actor(problem.task, config, streams["policy weights"])
    value = method_class.make_value(problem.task, config, streams["value weights"])
    return TwoPhaseLearner(problem, config, streams, actor, value, lambda slots: np.zeros((len(slots), 1), np.float32))


def train(seed: int, normalize_observations: bool = False, budget: int = BUDGET) -> float:
    """Train the PPO core on the pendulum; return its mean return over the task's evaluation instances."""
    torch.set_num_threads(1)
    learner = make_learner(seed, normalize_observations)
    while learner.env_steps < budget:
        learner.train(budget - learner.env_steps)
    return float(evaluate(learner.problem.task, learner.policy()).returns.mean())
