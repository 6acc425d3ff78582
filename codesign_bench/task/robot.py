"""What deployment on a robot arm asks of a task: trials, a simulator with other physics, what happened to the arm.

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
"""The Franka Panda of the paper, or the gantry that policies are trained with."""


@dataclass
class ArmReport:
    """What happened to the arm in one episode; steps are control steps, and one may count for several things."""

    unreachable_steps: int = 0
    """The commanded pose could not be reached within the joints' limits; the arm went as near as it could."""
    joint_limit_steps: int = 0
    """A joint stood at the end of its range."""
    velocity_limit_steps: int = 0
    """A joint would have had to move faster than it can, so the arm lagged behind."""
    torque_limit_steps: int = 0
    """A joint would have needed more torque than it has."""
    self_collision_steps: int = 0
    """The arm ran into itself or into the tool."""
    scene_contact_steps: int = 0
    """The arm, its tool excepted, touched something fixed: table or overhang."""
    object_contact_steps: int = 0
    """The arm, its tool excepted, touched a loose body, as when fingers push the cube."""
    tracking_error_sum: float = 0.0
    """Of the distances between commanded and reached held point at the end of control steps, m."""
    tracking_error_max: float = 0.0
    """The largest of them, m."""
    steps: int = 0
    """Control steps counted."""

    @property
    def tracking_error_mean(self) -> float:
        """Mean distance between commanded and reached held point, m; 0 before the first step."""
        return self.tracking_error_sum / max(self.steps, 1)


@dataclass(frozen=True)
class RobotTrials:
    """The trials of a task's tools on a robot, in the task's own frame."""

    own: Floats
    """(T, I): what each of T tools is designed for."""
    grid: Floats
    """(R, C, I): on which every tool is tried, the row that is farthest from the robot first; R is 0 without a grid."""
    success_outcome: float
    """The task's outcome at which an episode succeeds, in the outcome's unit."""
    near_miss: float
    """A failure whose outcome is this near to success counts as nearly solved, in the outcome's unit."""
    trials_per_tool: int
    """Trials with each tool on its own instance."""
    max_steps: int
    """Control steps until a trial ends without success."""


class DeployedSimulator(Simulator):
    """A simulator whose robot and physics can differ from those of training."""

    @abstractmethod
    def perturb(self, slot: int, friction: float, mass: float) -> None:
        """Multiply friction and mass of the loose bodies in `slot`; call it after `build`."""

    @abstractmethod
    def arm_report(self, slot: int) -> ArmReport:
        """Return what has happened to the arm in `slot` since `build`."""


def no_handle() -> tuple[ToolPart, ...]:
    """Return no part: the tools have a handle among their own parts, or no gripper holds them."""
    return ()


@dataclass(frozen=True)
class DeploymentSpec:
    """How a task's policies and tools are tried on a robot arm."""

    trials: RobotTrials
    make_simulator: Callable[[int, str], DeployedSimulator]
    """Returns a simulator with so many slots whose tools are held by an arm, one of `ARMS`."""
    gripper_handle: Callable[[], tuple[ToolPart, ...]] = no_handle
    """Returns what the gripper holds a printed tool by, beyond `Task.tool_parts`, in the frame of the held point.

    The first part touches the tool's node 0, every other one the part before it.
    """
