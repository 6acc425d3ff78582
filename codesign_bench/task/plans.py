"""Plans: a design and an open-loop control for every step, as one row of numbers in [-1, 1].

Shapes: `X` numbers of a plan, `D` design, `H` horizon, `C` control; any leading axes.
"""

from __future__ import annotations

from typing import TypeVar

from codesign_bench.task.spaces import Floats, Singles
from codesign_bench.task.task import Task

Numbers = TypeVar("Numbers", Floats, Singles)


def plan_size(task: Task) -> int:
    """Return X: a design and a control for each step."""
    return task.design_space.size + task.horizon * task.control_space.size


def designs_of(task: Task, plans: Numbers) -> Numbers:
    """Return the designs (..., D) of plans (..., X)."""
    return plans[..., : task.design_space.size]


def controls_of(task: Task, plans: Numbers) -> Numbers:
    """Return the controls (..., H, C) of plans (..., X)."""
    return plans[..., task.design_space.size :].reshape(*plans.shape[:-1], task.horizon, task.control_space.size)
