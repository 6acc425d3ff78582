"""The trials: each tool on its own instance and, in the paper's protocol, every tool on the grid.

Shapes: `I` instance.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from codesign_bench.deployment.tables import GRID, OWN
from codesign_bench.errors import UserError
from codesign_bench.task import Floats
from codesign_bench.task.robot import RobotTrials


@dataclass(frozen=True)
class Trial:
    """One trial to run."""

    kind: str
    """`OWN` or `GRID`."""
    tool: int
    """Number of the tool, starting at 1 as in the paper; it is designed for the instance with this number."""
    trial: int
    """Index among the trials of the same tool and instance, starting at 1."""
    row: int
    """Row of the grid, 0 is the farthest from the robot; -1 for the tool's own instance."""
    column: int
    """Column of the grid from the left; -1 for the tool's own instance."""
    instance: Floats
    """(I,)."""

    @property
    def name(self) -> str:
        """Unique name within a deployment."""
        place = f"-row-{self.row}-column-{self.column}" if self.kind == GRID else ""
        return f"{self.kind}-tool-{self.tool}{place}-trial-{self.trial}"


def own_trials(trials: RobotTrials, tools: Sequence[int], count: int) -> Iterator[Trial]:
    """Yield `count` trials of each tool on its own instance.

    Raises:
        UserError: there is no such tool.
    """
    for tool in tools:
        if not 1 <= tool <= len(trials.own):
            raise UserError(f"--tool {tool}: there is no such tool; choose from 1 to {len(trials.own)}")
        for number in range(1, count + 1):
            yield Trial(OWN, tool, number, -1, -1, trials.own[tool - 1])


def grid_trials(trials: RobotTrials, tools: Sequence[int]) -> Iterator[Trial]:
    """Yield one trial of each tool on every start of the grid; none if the task has no grid."""
    for tool in tools:
        for row, column in np.ndindex(trials.grid.shape[:2]):
            yield Trial(GRID, tool, 1, row, column, trials.grid[row, column])
