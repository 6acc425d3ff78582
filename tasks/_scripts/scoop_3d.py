"""A hand-written designer and controller for scoop 3D.

Shapes: `B` batch (may be absent), `O` observation, `D` = 10 design, `C` = 6 control.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from codesign_bench.task import Behaviour, Singles

from ..scoop_3d import BALLS_WANTED, MOVE_UP, TOOL_TURN, TURNS, WANTED, WAY_TO_LINE, Scoop3D


class Scoop3DScript(Behaviour):
    """A tool for each number of balls, lifted straight up and held still."""

    TOOLS: ClassVar[tuple[tuple[float, ...], ...]] = (
        (-0.9, -0.9, -0.3, -0.4, -0.8, -0.7, -0.3, 0.3, -0.3, -0.2),  # 1: the smallest plate
        (0.2, -0.9, -0.1, -0.2, -0.5, -0.6, -0.2, 0.6, -0.2, -0.3),  # 2: wider than long
        (0.8, -1.0, -0.1, -0.7, -0.1, -0.3, 0.6, 0.9, 0.7, 0.6),  # 3: wide, short and open
        (0.4, 0.5, -0.7, -0.7, -0.7, -0.7, -0.2, -0.2, -0.2, -0.2),  # 4: square and low
        (0.9, 0.1, -0.2, -0.9, -0.1, 0.1, -0.5, 0.4, -0.2, -0.2),  # 5: wide, low in front
        (0.9, 0.5, -0.1, -0.2, -0.2, -0.2, 0.5, 0.4, 0.1, 0.1),  # 6: large
        (1.0, 0.4, 0.2, -0.2, -0.6, -0.4, 0.6, 0.8, 0.9, -0.5),  # 7: large and open
    )
    """Normalised designs for 1 to 7 balls, found by a small search over tools lifted straight up."""
    SPARE_HEIGHT = 0.03
    """The tool is lifted this far above the line, m."""

    def __init__(self, task: Scoop3D) -> None:
        self.task = task

    def design(self, observation: Singles) -> Singles:
        """Return the tool for the requested number of balls."""
        wanted = np.rint(self.task.layout.split(observation).goal[..., BALLS_WANTED]).astype(np.intp)
        tools: Singles = np.array(self.TOOLS, dtype=np.float32)[wanted - WANTED[0]]
        return tools

    def act(self, observation: Singles) -> Singles:
        """Return the control that lifts the tool and keeps it level."""
        state, largest = self.task.layout.split(observation).state, self.task.control_space.bounds[1]
        control = np.zeros((*observation.shape[:-1], self.task.control_space.size), dtype=np.float32)
        control[..., MOVE_UP] = (state[..., WAY_TO_LINE] + self.SPARE_HEIGHT) / largest[MOVE_UP]
        control[..., TURNS] = -state[..., TOOL_TURN] / largest[TURNS]
        return np.clip(control, -1.0, 1.0)
