"""What a task is: spaces, instances, a batched simulator. It knows nothing of methods.

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
"""Seed of every task's fixed evaluation instances; training never uses it (ours)."""


ByProfile: TypeAlias = Mapping[str, Mapping[str, Any]]
"""Name of a profile -> name of a run setting -> value."""


class Task(ABC):
    """A goal-conditioned task of tool design and use (paper, section "Problem Setting").

    Spaces carry the units; policies see normalised designs and controls in [-1, 1].
    """

    name: ClassVar[str]
    """Its name, which is its file's name."""
    title: ClassVar[str]
    """Its name in figures."""
    version: ClassVar[int] = 1
    """Raised whenever its results can no longer be compared with earlier ones: another scene, reward or instances."""
    horizon: ClassVar[int]
    """Control steps until the time limit."""
    control_period: ClassVar[float]
    """Simulated time of one control step, in s."""
    design_space: ClassVar[Box]
    tool_graph: ClassVar[ToolGraph]
    control_space: ClassVar[Box]
    instance_space: ClassVar[Box]
    """All that differs between episodes: first the goal, then whatever the policies are not told as a goal."""
    goal_size: ClassVar[int]
    """How many leading entries of an instance are the goal."""
    position_entries: ClassVar[tuple[str, ...]] = ()
    """Names of the one or two entries of an instance that are a position, along x and y; empty: none is.

    These are what a cutout region is cut out of, and what maps of instances show.
    """
    state_space: ClassVar[Box]
    reward_terms: ClassVar[Mapping[str, str]] = NOTHING_NAMED
    """Name -> formula, with units, of each term that `Simulator.set_reward` adds up; empty: the task names none."""
    success_conditions: ClassVar[Mapping[str, str]] = NOTHING_NAMED
    """Name -> words, with units, for each condition of `Simulator.set_success`; empty: the task names none."""
    success_steps: ClassVar[int] = 1
    """Control steps in a row for which all of these conditions must hold."""
    failure_condition: ClassVar[str] = ""
    """When an episode is lost for good, in words with units; empty: never."""
    scene: ClassVar[Mapping[str, Constant]] = NOTHING_NAMED
    """Name -> number, with unit and source, of what the scene is made of: `constants(__name__)`."""
    outcome: ClassVar[Quantity | None] = None
    """What `Simulator.outcome` measures: how far the task got, whatever the reward."""
    soundness: ClassVar[Soundness | None] = None
    """What the task promises of its physics; built-in tasks all do."""
    run_settings: ClassVar[ByProfile] = {}
    """Profile -> run settings that this task wants otherwise, e.g. a larger budget."""
    num_evaluation_instances: ClassVar[int] = 128
    max_slots: ClassVar[int] = 1_000
    """Most slots to ask of one simulator when many episodes are to be played; a world may need much memory."""

    @property
    def goal_space(self) -> Box:
        """The leading, visible part of the instance space."""
        return self.instance_space.part(*self.instance_space.names[: self.goal_size])

    @property
    def layout(self) -> Layout:
        """The parts of this task's observations."""
        return Layout.of(self.state_space.size, self.goal_size, self.design_space.size)

    def sample_instances(self, rng: np.random.Generator, count: int) -> Floats:
        """Return (count, I) random instances, uniform in the instance space unless a task says otherwise."""
        return self.instance_space.sample(rng, count)

    def evaluation_instances(self) -> Floats:
        """Return the (num_evaluation_instances, I) instances on which every method is judged, always the same."""
        return self.sample_instances(generator(EVALUATION_SEED, self.name), self.num_evaluation_instances)

    @property
    def position_index(self) -> list[int]:
        """Where an instance holds its position, in the order of `position_entries`.

        Raises:
            UserError: no entry is a position.
        """
        if not self.position_entries:
            raise UserError(f"neither goals nor starts of task '{self.name}' are positions")
        return [self.instance_space.index(name) for name in self.position_entries]

    def in_region(self, instances: Floats) -> Booleans:
        """Return which positions of instances (b, I) are in the training region, its border included.

        By default the region is everything between the bounds of `position_entries`.

        Raises:
            UserError: no entry is a position.
        """
        index = self.position_index
        low, high = (bound[index] for bound in self.instance_space.bounds)
        inside: Booleans = np.all((low <= instances[:, index]) & (instances[:, index] <= high), axis=1)
        return inside

    def in_cutout(self, instances: Floats, fraction: float) -> Booleans:
        """Return which instances (b, I) are in the cutout region, `fraction` of the training region (section 5.2).

        Raises:
            UserError: the task has no goal or start that is a position.
        """
        raise UserError(f"--cutout: neither goals nor starts of task '{self.name}' are positions")

    def fine_tuning_instances(self) -> Floats:
        """Return the (b, I) instances outside the training region on which policies are tuned further (section 5.2).

        Raises:
            UserError: the task names none.
        """
        raise UserError(f"task '{self.name}' names no instances for fine-tuning")

    @abstractmethod
    def material(self, designs: Floats) -> Floats:
        """Return d_used / d_max in [0, 1] for designs (b, D) in their units (equation 1)."""

    @abstractmethod
    def effort(self, controls: Floats) -> Floats:
        """Return c_used / c_max in [0, 1] for controls (b, C) in [-1, 1] (equation 1)."""

    def tool_parts(self, design: Floats) -> tuple[ToolPart, ...]:
        """Return what the tool of a design (D,), in the design space's units, is made of.

        These are the shapes that the simulator lets collide, in the order of the tool graph's nodes and of one kind;
        they may overlap.

        Raises:
            UserError: the task does not say.
        """
        raise UserError(f"task '{self.name}' does not say what its tools are made of")

    def script(self) -> Behaviour:
        """Return a designer and a controller written by hand, for pictures and checks: functions of the observation.

        The controller uses whatever tool it is given. Neither needs to solve every instance.

        Raises:
            UserError: nobody wrote one.
        """
        raise UserError(f"task '{self.name}' has no script")

    @abstractmethod
    def make_simulator(self, num_slots: int, refinement: int = 1) -> Simulator:
        """Return a simulator with `num_slots` slots.

        Args:
            num_slots: episodes side by side.
            refinement: physics steps are this many times as many and as short (for checks; a task of a third party
                may leave this argument out).
        """

    @property
    def deployment(self) -> DeploymentSpec | None:
        """How policies and tools are tried on a robot arm; None: they cannot be."""
        return None
