"""One trial: a policy and a tool on a simulated arm.

Shapes: `I` instance, `D` design, `O` observation, `C` control.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from codesign_bench.deployment.conditions import Conditions, Physics
from codesign_bench.task import Behaviour, Floats, Singles, Task, deployment_of
from codesign_bench.task.behaviours import GivenDesigns
from codesign_bench.task.episodes import Episodes
from codesign_bench.task.play import first_observations, play
from codesign_bench.task.robot import ArmReport

METRE = "m"


@dataclass(frozen=True)
class Rollout:
    """The result of a trial."""

    success: bool
    failure: bool
    """Whether the trial ended in failure."""
    outcome: float
    """The task's outcome at the end, in the outcome's unit."""
    steps: int
    """Number of control steps."""
    physics: Physics
    arm: ArmReport


class Deployment:
    """A task's policy on an arm under given conditions, for a series of trials.

    Raises:
        UserError: the task cannot be deployed, or a condition is invalid.
    """

    def __init__(self, task: Task, policy: Behaviour, conditions: Conditions) -> None:
        conditions.check()
        self.task, self.policy, self.conditions = task, policy, conditions
        spec = deployment_of(task)
        self.simulator, self.max_steps = spec.make_simulator(1, conditions.arm), spec.trials.max_steps
        self.episodes = Episodes(task, 1, simulator=self.simulator)
        self._lengths = np.array([unit == METRE for unit in task.state_space.units])

    def unit_design(self, instance: Floats) -> Floats:
        """Return the policy's design (D,) in [-1, 1] for an instance (I,), observed without noise."""
        (design,) = np.asarray(self.policy.design(first_observations(self.episodes, instance[None])), dtype=np.float64)
        return np.asarray(design)

    def play(
        self,
        instance: Floats,
        unit_design: Floats,
        rng: np.random.Generator,
        watch: Callable[[Episodes], None] | None = None,
    ) -> Rollout:
        """Play a trial of a design (D,) in [-1, 1] on an instance (I,), until it ends or reaches the step limit.

        Args:
            instance: in the instance space's units.
            unit_design: the tool, possibly designed for another instance.
            rng: draws noise and physics.
            watch: called right after the design step and after every control step.
        """
        physics, simulator = Physics.draw(self.conditions, rng), self.simulator
        seen: deque[Singles] = deque(maxlen=self.conditions.latency + 1)
        behaviour = GivenDesigns(unit_design[None], self.policy)
        steps = 0
        for turn in play(self.episodes, behaviour, instance[None], lambda *_: self._observe(seen, rng)):
            if turn.step == 0:
                simulator.perturb(0, physics.friction, physics.mass)
            if watch is not None:
                watch(self.episodes)
            steps = turn.step
            if steps == self.max_steps:
                break
        return Rollout(
            success=bool(simulator.success[0]),
            failure=bool(simulator.failure[0]),
            outcome=float(simulator.outcome[0]),
            steps=steps,
            physics=physics,
            arm=simulator.arm_report(0),
        )

    def _observe(self, seen: deque[Singles], rng: np.random.Generator) -> Singles:
        """Return the policy's observation (1, O): state with delay and noise, goal, design and phase without."""
        result = self.episodes.observation.copy()
        state = result[:, self.episodes.layout.state]
        if self.conditions.observation_noise > 0.0:
            noise = self.conditions.observation_noise * rng.standard_normal(state.shape) * self._lengths
            state = np.clip(state + noise, self.task.state_space.low, self.task.state_space.high).astype(np.float32)
        seen.append(state.copy())
        result[:, self.episodes.layout.state] = seen[0]
        return result
