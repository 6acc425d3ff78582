"""What a task defines to be deployed on a robot arm: trials, a simulator with an arm, and a report on the arm.

Shapes: `T` tools, `R` rows and `C` columns of a grid, `I` instance.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

from codesign_bench.task.simulator import Simulator
from codesign_bench.task.spaces import Floats
from codesign_bench.task.tool import ToolPart

IDEAL, PANDA = "ideal", "panda"
ARMS = (PANDA, IDEAL)
"""The Franka Panda of the paper, and the gantry used in training."""


@dataclass
class ArmReport:
    """Events of the arm in one episode, in control steps; one step may count for several events."""

    unreachable_steps: int = 0
    """The commanded pose was out of reach within the joint limits; the arm moved as near to it as possible."""
    joint_limit_steps: int = 0
    """A joint was at the end of its range."""
    velocity_limit_steps: int = 0
    """A joint's speed limit was exceeded by the command, so the arm lagged behind."""
    torque_limit_steps: int = 0
    """A joint needed more torque than its limit."""
    self_collision_steps: int = 0
    """The arm collided with itself or with the tool."""
    scene_contact_steps: int = 0
    """The arm (not the tool) touched something fixed: table or overhang."""
    object_contact_steps: int = 0
    """The arm (not the tool) touched a loose body, e.g. the fingers pushed the cube."""
    tracking_error_sum: float = 0.0
    """Sum over control steps of the distance between commanded and reached held point at the step's end, m."""
    tracking_error_max: float = 0.0
    """The largest of these distances, m."""
    steps: int = 0
    """Number of control steps."""

    @property
    def tracking_error_mean(self) -> float:
        """Mean distance between commanded and reached held point, m; 0 before the first step."""
        return self.tracking_error_sum / max(self.steps, 1)


@dataclass(frozen=True)
class RobotTrials:
    """The trials of a task's tools on a robot, in the task's frame."""

    own: Floats
    """(T, I): the instance that each of T tools is designed for."""
    grid: Floats
    """(R, C, I): instances for every tool, the row farthest from the robot first; R is 0 without a grid."""
    success_outcome: float
    """The task's outcome at which an episode succeeds, in the outcome's unit."""
    near_miss: float
    """A failure within this distance of success counts as a near miss, in the outcome's unit."""
    trials_per_tool: int
    """Trials of each tool on its own instance."""
    max_steps: int
    """Control steps until a trial ends without success."""


class DeployedSimulator(Simulator):
    """A simulator whose robot and physics may differ from training."""

    @abstractmethod
    def perturb(self, slot: int, friction: float, mass: float) -> None:
        """Multiply friction and mass of the loose bodies in `slot`; call it after `build`."""

    @abstractmethod
    def arm_report(self, slot: int) -> ArmReport:
        """Return what has happened to the arm in `slot` since `build`."""


def no_handle() -> tuple[ToolPart, ...]:
    """Return no part: the tool's parts include a handle, or no gripper holds it."""
    return ()


@dataclass(frozen=True)
class DeploymentSpec:
    """How the policies and tools of a task are tried on a robot arm."""

    trials: RobotTrials
    make_simulator: Callable[[int, str], DeployedSimulator]
    """Maps a number of slots and an arm, one of `ARMS`, to a simulator in which this arm holds the tools."""
    gripper_handle: Callable[[], tuple[ToolPart, ...]] = no_handle
    """Returns the parts of a printed tool's handle, in addition to `Task.tool_parts`, in the frame of the held point.

    The first part touches the tool's node 0, every later one the part before it.
    """
