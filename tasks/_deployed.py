"""What tasks that can be deployed share: the paper's trials, the arm by its name, and what its gripper holds."""

from __future__ import annotations

from codesign_bench.errors import unknown_name
from codesign_bench.task import ToolPart
from codesign_bench.task.robot import ARMS, IDEAL

from ._carriers import Carrier
from ._scene import Clock

TRIALS_PER_TOOL = 5
"""Trials of each tool on its own instance (paper, section "Evaluation on a real robot")."""
TRIAL_STEPS = 100
"""Control steps until a trial ends without success (paper, appendix "Real Robot Experiment Details")."""
NEAR_MISS = 0.05
"""A cube that ends so near to success counts as nearly fetched, m (paper, caption of the grid's results); a cup so far
below the height of success counts as nearly lifted (ours)."""


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
