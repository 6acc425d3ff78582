"""Shared by deployable tasks: the paper's trials, carriers by name, and the handle for the gripper."""

from __future__ import annotations

from typing import Annotated

from codesign_bench.errors import unknown_name
from codesign_bench.task import Given, ToolPart, constants
from codesign_bench.task.robot import ARMS, IDEAL

from ._carriers import Carrier
from ._scene import Clock

REAL_ROBOT = 'paper, appendix "Real Robot Experiment Details"'
TRIALS_PER_TOOL: Annotated[int, Given("trials", 'paper, section "Evaluation on a real robot"', "trials")] = 5
"""Trials of each tool on its own instance."""
TRIAL_STEPS: Annotated[int, Given("control steps", REAL_ROBOT, "max_steps")] = 100
"""Control steps until a trial ends without success."""
NEAR_MISS: Annotated[float, Given("m", "paper, figure of the grid of starts", "near_miss")] = 0.05
"""A failure within this distance of success counts as a near miss; the paper has this only for the cube."""
DEPLOYED_SCENE = constants(__name__)
"""Constants of deployable tasks."""


def arm_carrier(arm: str, base: tuple[float, float, float], clock: Clock) -> Carrier | None:
    """Return the carrier for `arm`, one of `ARMS`, with its base at `base` (m); None for the task's gantry.

    Raises:
        UserError: an unknown arm.
    """
    if arm not in ARMS:
        raise unknown_name("arm", arm, ARMS)
    if arm == IDEAL:
        return None
    from ._panda import PandaArm  # imported here because training does not need pybullet_data

    return PandaArm(base, clock)


def gripper_handle() -> tuple[ToolPart, ...]:
    """Return the parts of the handle that the arm's fingers hold, from the held point outwards, in its frame."""
    from ._panda import HANDLE

    return HANDLE
