"""What tasks that can be deployed share: the paper's trials, the arm by its name, and what its gripper holds."""

from __future__ import annotations

from typing import Annotated

from codesign_bench.errors import unknown_name
from codesign_bench.task import Given, ToolPart, constants
from codesign_bench.task.robot import ARMS, IDEAL

from ._carriers import Carrier
from ._scene import Clock

REAL_ROBOT = 'paper, appendix "Real Robot Experiment Details"'
TRIALS_PER_TOOL: Annotated[int, Given("trials", 'paper, section "Evaluation on a real robot"', "trials")] = 5
"""With each tool on its own instance."""
TRIAL_STEPS: Annotated[int, Given("control steps", REAL_ROBOT, "max_steps")] = 100
"""Until a trial ends without success."""
NEAR_MISS: Annotated[float, Given("m", "paper, figure of the grid of starts", "near_miss")] = 0.05
"""A failure that ends this near to success counts as nearly solved; the paper counts so for the cube alone."""
DEPLOYED_SCENE = constants(__name__)
"""Constants of the tasks that can be deployed."""


def arm_carrier(arm: str, base: tuple[float, float, float], clock: Clock) -> Carrier | None:
    """Return the carrier that `arm`, one of `ARMS`, means, its base at `base` (m); None for the task's own gantry.

    Raises:
        UserError: there is no such arm.
    """
    if arm not in ARMS:
        raise unknown_name("arm", arm, ARMS)
    if arm == IDEAL:
        return None
    from ._panda import PandaArm  # here, since pybullet_data is needed by no training

    return PandaArm(base, clock)


def gripper_handle() -> tuple[ToolPart, ...]:
    """Return what the arm's fingers hold a tool by, from the held point outwards, in its frame."""
    from ._panda import HANDLE

    return HANDLE
