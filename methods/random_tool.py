"""The floor: PPO for a controller that sees its tool, with a tool drawn uniformly in every episode (ours).

Nothing is learned about tools; the policy acts with the middle of the design space. The controller copes with any tool,
which makes it the first phase of methods that search the design with a trained controller.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from codesign_bench.learning.ppo_config import PerceptronConfig

from ._given_design import WITHOUT_EFFECT, GivenDesignMethod


@dataclass(frozen=True, kw_only=True)
class Config(PerceptronConfig):
    """Hyperparameters of `random_tool`: PPO's and the perceptrons'."""

    not_searched: ClassVar = WITHOUT_EFFECT
    """Designs are drawn."""


class RandomTool(GivenDesignMethod[Config]):
    """A tool drawn uniformly in every episode, and PPO for a design-conditioned controller."""

    name = "random_tool"
    label = "random tool"
    tool_per_goal = False
    config_class = Config
