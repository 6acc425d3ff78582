"""The interface of a task: spaces, instances and a batched simulator. Tasks do not depend on methods.

Shapes: `b` batch, `I` instance, `G` goal, `D` design, `C` control.
A new task is one file in `tasks/` with one public subclass of `Task`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, TypeAlias

import numpy as np

from codesign_bench.errors import UserError
from codesign_bench.seeding import generator
from codesign_bench.task.behaviour import Behaviour
from codesign_bench.task.robot import DeploymentSpec
from codesign_bench.task.scene import Constant
from codesign_bench.task.simulator import Simulator, Soundness
from codesign_bench.task.spaces import Booleans, Box, Floats, Layout, Quantity
from codesign_bench.task.tool import ToolGraph, ToolPart

NOTHING_NAMED: Mapping[str, Any] = MappingProxyType({})
EVALUATION_SEED = 20231106
"""Seed of every task's fixed evaluation and validation instances, never used in training (ours)."""


ByProfile: TypeAlias = Mapping[str, Mapping[str, Any]]
"""Name of a profile -> name of a run setting -> value."""


class Task(ABC):
    """A goal-conditioned task of tool design and use (paper, section "Problem Setting").

    Spaces carry the units; policies see normalised designs and controls in [-1, 1].
    """

    name: ClassVar[str]
    """The task's name, which is also the name of its file."""
    title: ClassVar[str]
    """The task's name in figures."""
    version: ClassVar[int] = 1
    """Raised whenever results can no longer be compared with earlier ones: another scene, reward or instances."""
    missing: ClassVar[str] = ""
    """Why it can be described in this Python, but not played, e.g. for want of a package; empty: it can be played."""
    horizon: ClassVar[int]
    """Control steps until the time limit."""
    control_period: ClassVar[float]
    """Simulated time of one control step, in s."""
    design_space: ClassVar[Box]
    tool_graph: ClassVar[ToolGraph]
    control_space: ClassVar[Box]
    instance_space: ClassVar[Box]
    """Everything that varies between episodes: the goal, followed by hidden variation (not part of the goal)."""
    goal_size: ClassVar[int]
    """Number of leading entries of an instance that are the goal."""
    position_entries: ClassVar[tuple[str, ...]] = ()
    """Names of the one or two entries of an instance that are a position, along x and y; empty: no position.

    The cutout region is defined on these entries, and maps of instances show them.
    """
    state_space: ClassVar[Box]
    reward_terms: ClassVar[Mapping[str, str]] = NOTHING_NAMED
    """Name -> formula, with units, of each term that `Simulator.set_reward` sums; empty: the task names none."""
    success_conditions: ClassVar[Mapping[str, str]] = NOTHING_NAMED
    """Name -> description, with units, of each condition of `Simulator.set_success`; empty: the task names none."""
    success_steps: ClassVar[int] = 1
    """Number of consecutive control steps in which all of these conditions must hold."""
    failure_condition: ClassVar[str] = ""
    """When an episode fails before the time limit, in words with units; empty: never."""
    scene: ClassVar[Mapping[str, Constant]] = NOTHING_NAMED
    """Name -> constant of the scene, with unit and source: `constants(__name__)`."""
    outcome: ClassVar[Quantity | None] = None
    """What `Simulator.outcome` measures: progress on the task, independent of the reward."""
    soundness: ClassVar[Soundness | None] = None
    """Guarantees of the task's physics; all built-in tasks have them."""
    run_settings: ClassVar[ByProfile] = {}
    """Profile -> run settings that differ for this task, e.g. a larger budget."""
    num_evaluation_instances: ClassVar[int] = 128
    max_slots: ClassVar[int] = 1_000
    """Most slots to request of one simulator for many episodes. Few keep memory low and spread work over many cores;
    many make a call of the policy cheap per step."""

    @property
    def goal_space(self) -> Box:
        """The leading, observed part of the instance space."""
        return self.instance_space.part(*self.instance_space.names[: self.goal_size])

    @property
    def layout(self) -> Layout:
        """The parts of this task's observations."""
        return Layout.of(self.state_space.size, self.goal_size, self.design_space.size)

    def sample_instances(self, rng: np.random.Generator, count: int) -> Floats:
        """Return (count, I) random instances; by default uniform in the instance space."""
        return self.instance_space.sample(rng, count)

    def evaluation_instances(self) -> Floats:
        """Return the (num_evaluation_instances, I) fixed instances on which every method is evaluated."""
        return self.sample_instances(generator(EVALUATION_SEED, self.name), self.num_evaluation_instances)

    def validation_instances(self) -> Floats:
        """Return as many other fixed instances, on which settings are chosen; no reported result uses them."""
        rng = generator(EVALUATION_SEED, f"validation of {self.name}")
        return self.sample_instances(rng, self.num_evaluation_instances)

    @property
    def position_index(self) -> list[int]:
        """Indices of the position in an instance, in the order of `position_entries`.

        Raises:
            UserError: the task has no position.
        """
        if not self.position_entries:
            raise UserError(f"neither goals nor starts of task '{self.name}' are positions")
        return [self.instance_space.index(name) for name in self.position_entries]

    def in_region(self, instances: Floats) -> Booleans:
        """Return which positions of instances (b, I) are in the training region, including its border.

        By default the region is the box between the bounds of `position_entries`.

        Raises:
            UserError: the task has no position.
        """
        index = self.position_index
        low, high = (bound[index] for bound in self.instance_space.bounds)
        inside: Booleans = np.all((low <= instances[:, index]) & (instances[:, index] <= high), axis=1)
        return inside

    def in_cutout(self, instances: Floats, fraction: float) -> Booleans:
        """Return which instances (b, I) are in the cutout region, `fraction` of the training region (section 5.2).

        Raises:
            UserError: the task has no position.
        """
        raise UserError(f"--cutout needs a task whose goals or starts are positions; '{self.name}' has none")

    def fine_tuning_instances(self) -> Floats:
        """Return instances outside the training region on which policies are fine-tuned (section 5.2).

        Returns:
            (p, k, I): p places with k instances each. The first instance of a place is the place itself; the others
            are close to it, so that "solved" is a rate instead of the outcome of one episode.

        Raises:
            UserError: the task has none.
        """
        raise UserError(f"task '{self.name}' has no fine-tuning instances")

    @abstractmethod
    def material(self, designs: Floats) -> Floats:
        """Return d_used / d_max in [0, 1] for designs (b, D) in their units (equation 1)."""

    @abstractmethod
    def effort(self, controls: Floats) -> Floats:
        """Return c_used / c_max in [0, 1] for controls (b, C) in [-1, 1] (equation 1)."""

    def tool_parts(self, design: Floats) -> tuple[ToolPart, ...]:
        """Return the parts of the tool for a design (D,) in the design space's units.

        These are the collision shapes of the simulator, in the order of the tool graph's nodes and all of one type;
        they may overlap.

        Raises:
            UserError: the task does not define them.
        """
        raise UserError(f"task '{self.name}' does not define the parts of its tools")

    def script(self) -> Behaviour:
        """Return a hand-written designer and controller, functions of the observation, for pictures and checks.

        The controller must work with any tool. Neither needs to solve every instance.

        Raises:
            UserError: the task has no script.
        """
        raise UserError(f"task '{self.name}' has no script")

    @abstractmethod
    def make_simulator(self, num_slots: int, refinement: int = 1) -> Simulator:
        """Return a simulator with `num_slots` slots.

        Args:
            num_slots: number of parallel episodes.
            refinement: divides the physics step by this factor (for checks; a third-party task may omit this argument).
        """

    @property
    def deployment(self) -> DeploymentSpec | None:
        """How policies and tools are tried on a robot arm; None: the task cannot be deployed."""
        return None
