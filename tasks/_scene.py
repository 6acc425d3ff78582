"""Shared by planar and 3D tasks: physics steps of a control step, collision-free starts, colours of pictures.

Shapes: `b` episodes, `K` links of a tool.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codesign_bench.task import Floats

PICTURE_PIXELS = 480
"""Longer side of a picture, pixels."""
COLOURS = {
    "background": "#ffffff",
    "scene": "#8a8f98",
    "tool": "#2c6fbb",
    "object": "#e08a2e",
    "goal": "#3a9d5d",
}
"""Colours of pictures of scenes."""


@dataclass(frozen=True)
class Clock:
    """The physics steps of one control step."""

    steps: int
    period: float
    """Duration of one physics step, s."""

    @property
    def control_period(self) -> float:
        """Duration of one control step, s."""
        return self.steps * self.period

    def refined(self, factor: int) -> Clock:
        """Return the same duration divided into `factor` times as many steps."""
        return Clock(self.steps * factor, self.period / factor)


def nearest_clear_shift(low: Floats, high: Floats, allowed: tuple[float, float] = (-np.inf, np.inf)) -> Floats:
    """Return the shifts (b,) nearest to zero that are in no blocked interval, m.

    Each is zero or an end of an interval, since any other clear shift could be moved a little nearer to zero. The
    caller ensures that at least one of these is allowed.

    Args:
        low: lower ends (b, K) of the intervals of shifts at which a link is too close to something, m.
        high: their upper ends (b, K), m; NaN at both ends means that there is no interval.
        allowed: smallest and largest allowed shift, m.
    """
    candidates = np.concatenate([np.zeros((len(low), 1)), low, high], axis=1)
    # The ends of an interval are clear; a nanometre allows for rounding. Comparisons with NaN are false.
    blocked = (candidates[:, :, None] > low[:, None] + 1e-9) & (candidates[:, :, None] < high[:, None] - 1e-9)
    beyond = (candidates < allowed[0]) | (candidates > allowed[1])
    distance = np.where(blocked.any(axis=2) | beyond | np.isnan(candidates), np.inf, np.abs(candidates))
    shift: Floats = candidates[np.arange(len(low)), distance.argmin(axis=1)]
    return shift
