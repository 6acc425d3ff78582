"""What planar and 3D tasks share: the physics steps of a control step, and how pictures look."""

from __future__ import annotations

from dataclasses import dataclass

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
