"""A task and a method that keep every promise, and do without nothing that a check looks at; tests break them.

`sound_reach` is `toy_reach` with everything optional; `sound_search` is `toy_search` with short last batches.

Shapes: `b` slots that a call names, `D` design, `C` control, `I` instance.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import numpy as np

from codesign_bench.method import BatchReport, Method
from codesign_bench.task import (
    OURS,
    Behaviour,
    Floats,
    Frame,
    Given,
    Physics,
    PlanarPart,
    Quantity,
    Simulator,
    Singles,
    Slots,
    Soundness,
    Task,
    ToolPart,
    constants,
)
from toy import STEP, ConstantPolicy, ToyReach, ToySearch

TOLERANCE: Annotated[float, Given("m", OURS)] = 0.05
"""The tip must come so close to the goal."""


class Sticks(Simulator):
    """Sticks on a line, as in the toy."""

    def __init__(self, num_slots: int, refinement: int = 1) -> None:
        super().__init__(num_slots, state_size=1)
        self.refinement = refinement
        self.goal, self.tip, self.speed = np.zeros((3, num_slots))

    def begin(self, slots: Slots, instances: Floats) -> None:
        """Put the goals at `instances` (b, I)."""
        self.forget(slots)
        self.goal[slots], self.tip[slots], self.speed[slots] = instances[:, 0], 0.0, 0.0
        self.state[slots, 0] = 0.0

    def build(self, slots: Slots, designs: Floats) -> None:
        """Give the sticks the lengths `designs` (b, D)."""
        self.tip[slots] = designs[:, 0]
        self.state[slots, 0] = self.tip[slots]

    def step(self, slots: Slots, controls: Floats) -> None:
        """Move the sticks by `controls` (b, C)."""
        before = np.abs(self.tip[slots] - self.goal[slots])
        for _ in range(self.refinement):
            self.tip[slots] += STEP * controls[:, 0] / self.refinement
        self.speed[slots] = np.abs(controls[:, 0])
        distance = np.abs(self.tip[slots] - self.goal[slots])
        self.state[slots, 0] = self.tip[slots]
        self.outcome[slots] = -distance
        self.set_success(slots, at_goal=distance < TOLERANCE)
        self.set_reward(slots, progress=before - distance, success=1.0 * self.success[slots])

    def inspect(self, slot: int) -> Physics:
        """Return that nothing overlaps."""
        return Physics(overlap=0.0, speed=float(self.speed[slot]), contained=True)

    def render(self, slot: int) -> Frame:
        """Return a line of dots: goal and tip."""
        picture: Frame = np.zeros((1, 200, 3), dtype=np.uint8)
        for place, colour in ((self.goal[slot], 100), (self.tip[slot], 200)):
            picture[0, int(np.clip(100 + 50 * place, 0, 199))] = colour
        return picture


class SoundReach(ToyReach):
    """Touch the goal with the tip of a stick.

    Action space
        Design, 1: length. Control, 1: speed.

    Observation
        State, 1: the tip. Goal, 1: its place.

    Goal space
        Uniform.

    Reward
        Progress, and a bonus on success.

    Starting state
        The foot at zero.

    Episode end
        Success, or the time limit.
    """

    name = "sound_reach"
    title = "Sound reach"
    reward_terms: ClassVar = {"progress": "d_before - d_after, m", "success": "1 in the step that solves the task"}
    success_conditions: ClassVar = {"at_goal": "the tip is at the goal"}
    scene: ClassVar = constants(__name__)
    outcome = Quantity("minus the distance", "m")
    soundness = Soundness(overlap=0.0, speed=1.0, outcome_change=1e-6)
    simulator_class: type[Simulator] = Sticks

    def fine_tuning_instances(self) -> Floats:
        """Return one place outside of the region, with eight goals."""
        return 1.2 + 0.01 * np.arange(8.0).reshape(1, 8, 1)

    def tool_parts(self, design: Floats) -> tuple[ToolPart, ...]:
        """Return the stick."""
        return (PlanarPart((0.0, 0.0), (float(design[0]), 0.0), 0.01),)

    def script(self) -> Behaviour:
        """Return a script that makes a stick as long as the goal is far, and corrects it."""
        return Script()

    def make_simulator(self, num_slots: int, refinement: int = 1) -> Simulator:
        """Return sticks on a line."""
        return self.simulator_class(num_slots, refinement)  # type: ignore[call-arg]


class Script(Behaviour):
    """The observation is [tip, goal, design, phase]."""

    def design(self, observation: Singles) -> Singles:
        """Return a stick as long as the goal is far."""
        return ToyReach.design_space.to_unit(observation[..., 1:2]).clip(-1.0, 1.0).astype(np.float32)

    def act(self, observation: Singles) -> Singles:
        """Return the way to the goal."""
        return np.clip((observation[..., 1:2] - observation[..., 0:1]) / STEP, -1.0, 1.0).astype(np.float32)


class SoundSearch(ToySearch):
    """The toy, with a batch no longer than what is left."""

    name = "sound_search"
    label = "Sound search"
    tool_per_goal = False

    def train(self, remaining_steps: int) -> BatchReport:
        """Judge one neighbour on as many episodes as there is room for."""
        count = max(1, min(self.config.episodes, remaining_steps // (self.problem.task.horizon + 1)))
        candidate = np.clip(self.best + self.config.step_size * self.streams["search"].normal(size=2), -1.0, 1.0)
        earned, env_steps = self._rollout(ConstantPolicy(candidate), count)
        if earned > self.best_return:
            self.best, self.best_return = candidate, earned
        self.env_steps += env_steps
        return BatchReport(env_steps, {"candidate_return": earned}, gradient_steps=1)


def changed(member: type[Any], **attributes: Any) -> Any:
    """Return a subclass of a member with other attributes, which keeps its name and docstring."""
    return type(member.__name__, (member,), {"__doc__": member.__doc__, "__module__": __name__, **attributes})


def changed_task(simulator: dict[str, Any] | None = None, **attributes: Any) -> type[Task]:
    """Return `SoundReach` with other attributes, and its simulator with others."""
    kept: type[Task] = changed(SoundReach, simulator_class=changed(Sticks, **(simulator or {})), **attributes)
    return kept


def changed_method(**attributes: Any) -> type[Method[Any]]:
    """Return `SoundSearch` with other attributes."""
    kept: type[Method[Any]] = changed(SoundSearch, **attributes)
    return kept
