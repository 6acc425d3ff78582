"""What planar and 3D tasks share: the physics steps of a control step, starts clear of objects, how pictures look.

Shapes: `b` episodes, `K` links of a tool.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codesign_bench.task import Floats

PICTURE_PIXELS = 480
"""Longer side of a picture."""
COLOURS = {
    "background": "#ffffff",
    "scene": "#8a8f98",
    "tool": "#2c6fbb",
    "object": "#e08a2e",
    "goal": "#3a9d5d",
}
"""What pictures of scenes are drawn in."""


@dataclass(frozen=True)
class Clock:
    """The physics steps of one control step."""

    steps: int
    period: float
    """Of one physics step, s."""

    @property
    def control_period(self) -> float:
        """Time of one control step, s."""
        return self.steps * self.period

    def refined(self, factor: int) -> Clock:
        """Return the same time cut into `factor` times as many steps."""
        return Clock(self.steps * factor, self.period / factor)


def nearest_clear_shift(low: Floats, high: Floats, allowed: tuple[float, float] = (-np.inf, np.inf)) -> Floats:
    """Return the shifts (b,) nearest to zero that are in no blocked interval, m.

    It is zero or an end of an interval, since any other clear shift could be brought a little nearer to zero. The
    caller knows that one of them is allowed.

    Args:
        low: lower ends (b, K) of the intervals of shifts at which a link is too close to something, m.
        high: their upper ends (b, K), m; NaN at both ends: there is no interval.
        allowed: smallest and largest shift that may be taken, m.
    """
    candidates = np.concatenate([np.zeros((len(low), 1)), low, high], axis=1)
    # The ends themselves are clear; a nanometre allows for rounding. NaN compares as false.
    blocked = (candidates[:, :, None] > low[:, None] + 1e-9) & (candidates[:, :, None] < high[:, None] - 1e-9)
    beyond = (candidates < allowed[0]) | (candidates > allowed[1])
    distance = np.where(blocked.any(axis=2) | beyond | np.isnan(candidates), np.inf, np.abs(candidates))
    shift: Floats = candidates[np.arange(len(low)), distance.argmin(axis=1)]
    return shift
