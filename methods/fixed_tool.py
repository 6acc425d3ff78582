"""What control alone can do: PPO control with one given tool, which nothing changes (ours).

A method that designs is worth its design only where it ends above this one, with the same budget for control.

Shapes: `S` slots, `D` design.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, TypeAlias

import numpy as np

from codesign_bench.config.settings import Settings
from codesign_bench.config.values import Length, Within
from codesign_bench.errors import UserError
from codesign_bench.learning.explorer import Explorer, FixedDesigns, Trial
from codesign_bench.learning.ppo_config import PerceptronConfig
from codesign_bench.method import Problem
from codesign_bench.seeding import Streams
from codesign_bench.task import load_task

from ._given_design import WITHOUT_EFFECT, GivenDesignMethod
from ._settings import tuned_for

BEST_TOOLS: Mapping[str, tuple[float, ...]] = {
    "push": (-0.677, -0.835, -0.067, 0.253, -0.013),
    "catch_balls": (-1.000, 1.000, 1.000, 1.000, 1.000),
    "scoop": (-0.235, -0.989, 0.846, 0.222, 0.798),
    "fetch_cube": (-0.419, 0.906, -0.243, 0.024, 0.522, -0.977, 0.206, 0.412, -0.159, -0.534, -0.861),
    "lift_cup": (-0.699, 0.717, -0.777, -0.762, -0.409),
    "scoop_3d": (0.137, 0.862, 0.750, 0.513, -0.299, -0.994, -0.719, 0.503, 0.592, -0.549),
    "bounce": (-0.406, 0.338, -0.219, 0.800, 0.800),
    "gather": (-1.000, -1.000, -1.000, -1.000, -0.410, 0.310, 1.000),
}
"""For each task the tool that does most with the script's controller on validation instances, of 216 tools (ours).

They are what `evaluation.reference_points.single_tool` finds, to three decimals.
"""

UnitParameter: TypeAlias = Annotated[float, Within(-1.0, 1.0)]


@dataclass(frozen=True, kw_only=True)
class Config(PerceptronConfig):
    """Hyperparameters of `fixed_tool`: PPO's and the perceptrons', and the tool."""

    not_searched: ClassVar = (*WITHOUT_EFFECT, "unit_design")
    """The tool is given."""
    unit_design: Annotated[tuple[UnitParameter, ...], Length(0, 64)] = ()
    """The tool, each parameter from -1 to 1 over its range; none: the middle of the design space."""


class FixedTool(GivenDesignMethod[Config]):
    """One given tool for all goals, and PPO for its control."""

    name = "fixed_tool"
    label = "fixed tool"
    tool_per_goal = False
    config_class = Config

    def __init__(self, problem: Problem, config: Config, streams: Streams) -> None:
        super().__init__(problem, config, streams)
        if config.unit_design:
            self.actor.act_with(np.array(config.unit_design))

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Settings:
        """Return PPO's settings, and the tool."""
        tools: dict[str, dict[str, Any]] = {task: {"unit_design": tool} for task, tool in BEST_TOOLS.items()}
        return {**super().profile(profile, task_name), **tuned_for(profile, task_name, tools)}

    @classmethod
    def check(cls, config: Config, task_name: str) -> None:
        """Check that the tool is one of the task's.

        Raises:
            UserError: it has another number of parameters.
        """
        given, size = len(config.unit_design), load_task(task_name).design_space.size
        if given not in (0, size):
            raise UserError(f"unit_design has {given} numbers; the tools of '{task_name}' have {size}")

    def give_designs(self, explorer: Explorer, steps: int, slots: int) -> tuple[Explorer, int]:
        """Give every slot the tool."""
        designs = self.actor.best_design.numpy()[None].repeat(slots, axis=0)
        return FixedDesigns(explorer, Trial(designs)), slots
