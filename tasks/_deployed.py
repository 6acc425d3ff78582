"""What tasks that can be deployed share: the arm by its name, and what its gripper holds."""

from __future__ import annotations

from codesign_bench.errors import unknown_name
from codesign_bench.task import ToolPart
from codesign_bench.task.robot import ARMS, IDEAL

from ._carriers import Carrier
from ._scene import Clock


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
