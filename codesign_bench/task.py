"""What a task is: spaces, instances, a batched simulator. It knows nothing of methods.

Shapes: `B` slots of a simulator, `b` the slots a call names, `I` instance, `G` goal, `S` state, `D` design,
`C` control.
A new task is one file in `tasks/` with one public subclass of `Task`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from codesign_bench.errors import UserError
from codesign_bench.registry import load, names
from codesign_bench.seeding import generator

if TYPE_CHECKING:
    from codesign_bench.deployment.robot import DeployedSimulator, RobotTrials

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Booleans = NDArray[np.bool_]
Slots = NDArray[np.intp]
Frame = NDArray[np.uint8]

EVALUATION_SEED = 20231106
"""Seed of every task's fixed evaluation instances; training never uses it (ours)."""


@dataclass(frozen=True)
class Box:
    """A bounded space whose every entry has a name, a unit and a range in that unit."""

    names: tuple[str, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    units: tuple[str, ...]

    def __post_init__(self) -> None:
        if not len(self.names) == len(self.low) == len(self.high) == len(self.units):
            raise ValueError(f"names, low, high and units differ in length: {self}")

    @classmethod
    def of(cls, **entries: tuple[float, float, str]) -> Box:
        """Build a space from `name=(low, high, unit)` entries."""
        low, high, units = zip(*entries.values(), strict=True) if entries else ((), (), ())
        return cls(tuple(entries), low, high, units)

    @property
    def size(self) -> int:
        """Number of entries."""
        return len(self.names)

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lower and upper bounds, each (size,), in the entries' units."""
        return np.array(self.low, dtype=np.float64), np.array(self.high, dtype=np.float64)

    def from_unit(self, values: ArrayLike) -> Floats:
        """Map (..., size) values in [-1, 1] to the entries' units; values outside are clipped."""
        low, high = self.bounds
        return low + (np.clip(np.asarray(values, dtype=np.float64), -1.0, 1.0) + 1.0) * 0.5 * (high - low)

    def to_unit(self, values: ArrayLike) -> Floats:
        """Map (..., size) values in the entries' units to [-1, 1]."""
        low, high = self.bounds
        return 2.0 * (np.asarray(values, dtype=np.float64) - low) / (high - low) - 1.0

    def sample(self, rng: np.random.Generator, count: int) -> Floats:
        """Return (count, size) points, uniform in the box, in the entries' units."""
        return rng.uniform(*self.bounds, size=(count, self.size))


@dataclass(frozen=True)
class ToolGraph:
    """The tool as a graph: its links are the nodes, its joints the edges; node 0 is the link that the robot holds.

    `parameter_nodes[d]` is the node that design parameter `d` belongs to.
    """

    num_nodes: int
    edges: tuple[tuple[int, int], ...]
    parameter_nodes: tuple[int, ...]


@dataclass(frozen=True)
class BoxPart:
    """A box that a tool is made of, in the frame of the held point."""

    half_extents: tuple[float, float, float]
    """m."""
    centre: tuple[float, float, float]
    """m."""
    rotation: tuple[float, float, float, float]
    """Quaternion (x, y, z, w)."""


@dataclass(frozen=True)
class PlanarPart:
    """A straight link with round ends that a planar tool is made of, in the frame of the held point."""

    start: tuple[float, float]
    """m."""
    end: tuple[float, float]
    """m."""
    radius: float
    """Half the link's thickness, m."""


ToolPart: TypeAlias = BoxPart | PlanarPart


@dataclass(frozen=True)
class Layout:
    """Where each part of an observation lies: [state | goal | design | phase].

    The phase part is (design phase?, control phase?, elapsed fraction of the horizon).
    """

    state: slice
    goal: slice
    design: slice
    phase: slice

    PHASE_NAMES: ClassVar[tuple[str, ...]] = ("design_phase", "control_phase", "elapsed_fraction")

    @classmethod
    def of(cls, state: int, goal: int, design: int) -> Layout:
        """Lay out an observation of the given part sizes."""
        ends = np.cumsum([state, goal, design, len(cls.PHASE_NAMES)])
        return cls(
            *(slice(int(end - size), int(end)) for end, size in zip(ends, (state, goal, design, 3), strict=True))
        )

    @property
    def size(self) -> int:
        """Length of an observation."""
        return self.phase.stop


class Behaviour(ABC):
    """A designer and a controller as functions of the observation: a task's script, or a trained policy."""

    @abstractmethod
    def design(self, observation: Singles) -> Singles:
        """Return the design (D,) or (B, D) in [-1, 1] for an observation (O,) or (B, O) of the design phase."""

    @abstractmethod
    def act(self, observation: Singles) -> Singles:
        """Return the control (C,) or (B, C) in [-1, 1] for an observation (O,) or (B, O) of the control phase."""


@dataclass(frozen=True)
class Quantity:
    """What a number of a task measures, and its unit."""

    name: str
    unit: str


@dataclass(frozen=True)
class Physics:
    """What a scene looks like to someone who checks its physics."""

    overlap: float
    """Deepest overlap of two bodies that should not overlap, m; 0 when none do."""
    speed: float
    """Speed of the fastest body, the tool's excepted, m/s."""
    contained: bool
    """Whether every body is on its side of every wall and floor (or lies where it could have fallen)."""


@dataclass(frozen=True)
class Soundness:
    """What a task promises of its physics, for any design and any control; tests hold it to that."""

    overlap: float
    """No two bodies overlap deeper than this, m."""
    speed: float
    """Nothing but the tool is ever faster than this, m/s."""
    outcome_change: float
    """Halving the physics step changes the outcome of a scripted episode by less than this, in the outcome's unit.

    It holds for the median episode; where contact is chaotic, for the mean over instances, and a two-sample
    Kolmogorov-Smirnov test does not tell the outcomes' distributions apart.
    """
    start_overlap: float = 1e-3
    """Right after the design step, no design overlaps anything deeper than this, m."""
    chaotic: bool = False
    """Whether many bodies in contact make single episodes depend on the last bit."""


class Simulator(ABC):
    """Many independent episodes of one task in one process; slot `i` holds one episode.

    A call names the slots it means and touches no other. What happens in a slot depends on what was sent to that
    slot since its `begin` alone, so an episode is the same alone and in any batch.
    """

    def __init__(self, num_slots: int, state_size: int) -> None:
        self.num_slots = num_slots
        self.state: Singles = np.zeros((num_slots, state_size), dtype=np.float32)
        """(B, S) task state, written in place."""
        self.reward: Floats = np.zeros(num_slots)
        """(B,) reward of the last step."""
        self.success: Booleans = np.zeros(num_slots, dtype=bool)
        """(B,) whether the task is solved; ends the episode."""
        self.failure: Booleans = np.zeros(num_slots, dtype=bool)
        """(B,) whether the episode is lost for good (a cup that fell off the table); ends it, too."""
        self.outcome: Floats = np.zeros(num_slots)
        """(B,) the task's outcome quantity as it stands now; no part of the observation."""

    @abstractmethod
    def begin(self, slots: Slots, instances: Floats) -> None:
        """Put the scenes of `slots` (b,) at the start of `instances` (b, I), without a tool."""

    @abstractmethod
    def build(self, slots: Slots, designs: Floats) -> None:
        """Add the tools `designs` (b, D), in the design space's units, to the scenes."""

    @abstractmethod
    def step(self, slots: Slots, controls: Floats) -> None:
        """Advance `slots` by one control step with `controls` (b, C) in [-1, 1]; write state, reward and both ends."""

    def advance(self, slots: Slots) -> None:
        """Make the engine's own physics steps of one control step, and nothing else: the raw cost of a step.

        Raises:
            NotImplementedError: the task has no engine.
        """
        raise NotImplementedError

    def inspect(self, slot: int) -> Physics:
        """Return what the scene in `slot` looks like to someone who checks its physics; changes nothing.

        Raises:
            NotImplementedError: the task does not tell.
        """
        raise NotImplementedError

    def tool_shapes(self, slot: int) -> tuple[ToolPart, ...]:
        """Return what the engine itself lets collide as the tool in `slot`, in the frame of the held point.

        Raises:
            NotImplementedError: the task does not tell.
        """
        raise NotImplementedError

    def render(self, slot: int) -> Frame:
        """Return a picture of the scene in `slot`, (height, width, 3), in RGB; needs no display and changes nothing.

        Raises:
            NotImplementedError: the task draws no pictures.
        """
        raise NotImplementedError


class Task(ABC):
    """A goal-conditioned task of tool design and use (paper, section "Problem Setting").

    Spaces carry the units; policies see normalised designs and controls in [-1, 1].
    """

    name: ClassVar[str]
    """Its name, which is its file's name."""
    title: ClassVar[str]
    """Its name in figures."""
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
    state_space: ClassVar[Box]
    outcome: ClassVar[Quantity | None] = None
    """What `Simulator.outcome` measures: how far the task got, whatever the reward."""
    soundness: ClassVar[Soundness | None] = None
    """What the task promises of its physics; built-in tasks all do."""
    num_evaluation_instances: ClassVar[int] = 128
    max_slots: ClassVar[int] = 1_000
    """Most slots to ask of one simulator when many episodes are to be played; a world may need much memory."""

    @property
    def goal_space(self) -> Box:
        """The leading, visible part of the instance space."""
        space, count = self.instance_space, self.goal_size
        return Box(space.names[:count], space.low[:count], space.high[:count], space.units[:count])

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

    def in_cutout(self, instances: Floats, fraction: float) -> Booleans:
        """Tell which instances (b, I) lie in the cutout region, `fraction` of the training region (section 5.2).

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
            UserError: the task does not tell.
        """
        raise UserError(f"task '{self.name}' does not tell what its tools are made of")

    def gripper_handle(self) -> tuple[ToolPart, ...]:
        """Return what a robot's gripper holds a printed tool by, beyond `tool_parts`, in the frame of the held point.

        The first part touches the tool's node 0, every other one the part before it. None by default: the task has no
        gripper, or the tool has a handle of its own.
        """
        return ()

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

    def make_deployed_simulator(self, num_slots: int, arm: str) -> DeployedSimulator:
        """Return a simulator with `num_slots` slots whose tools are held by `arm`, one of `deployment.robot.ARMS`.

        Raises:
            UserError: the task has none.
        """
        raise UserError(f"task '{self.name}' has no deployment; choose from: {', '.join(deployable_tasks())}")

    def robot_trials(self) -> RobotTrials:
        """Return the instances of the paper's evaluation on a real robot.

        Raises:
            UserError: the task has none.
        """
        raise UserError(f"task '{self.name}' has no deployment; choose from: {', '.join(deployable_tasks())}")


def task_names() -> tuple[str, ...]:
    """Return the names of all tasks, built-in and third-party."""
    return names("tasks")


def deployable_tasks() -> tuple[str, ...]:
    """Return the names of the tasks that can be deployed on an arm."""
    base = Task.make_deployed_simulator
    return tuple(name for name in task_names() if type(load_task(name)).make_deployed_simulator is not base)


def load_task(name: str) -> Task:
    """Return the task `name`.

    Raises:
        UserError: there is no such task.
    """
    task: Task = load("tasks", name, Task)()
    return task
