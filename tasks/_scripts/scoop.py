"""A hand-written designer and controller for scoop.

Shapes: `B` batch (may be absent), `O` observation, `D` = 5 design, `C` = 3 control.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from codesign_bench.task import Behaviour, Singles

from ..scoop import GOAL_NUMBERS, MOVE_UP, WANTED, Scoop


class ScoopScript(Behaviour):
    """Lifts the tool straight up, so that only its shape determines how many balls stay on it."""

    SHAPES: ClassVar[tuple[tuple[float, ...], ...]] = (
        (-0.3, -0.8, -0.9, -0.1, 0.3),
        (-0.5, 0.0, -0.9, -0.4, 1.0),
        (0.1, -0.9, -0.7, 0.6, 0.6),
        (0.5, -1.0, -0.6, 0.9, -0.5),
        (0.1, -0.9, 0.1, 0.6, 0.4),
        (0.8, 0.4, -0.9, 0.6, 0.4),
        (0.2, 0.0, 0.8, 0.8, 0.9),
    )
    """A ladle for each of 1 to 7 balls, as normalised designs: the best of a few hundred random tools."""

    def __init__(self, task: Scoop) -> None:
        self.task = task

    def design(self, observation: Singles) -> Singles:
        """Return the ladle for the requested number of balls."""
        wanted = np.rint(self.task.layout.split(observation).goal[..., WANTED]).astype(int)
        shapes: Singles = np.array(self.SHAPES, dtype=np.float32)[wanted - GOAL_NUMBERS[0]]
        return shapes

    def act(self, observation: Singles) -> Singles:
        """Return the control that moves straight up, normalised."""
        result: Singles = np.zeros((*observation.shape[:-1], self.task.control_space.size), dtype=np.float32)
        result[..., MOVE_UP] = 1.0
        return result
