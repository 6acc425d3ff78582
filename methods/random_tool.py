"""The floor: PPO for a controller that sees its tool, with a tool drawn uniformly in every episode (ours).

Nothing is learned about tools; the policy acts with the middle of the design space. The controller copes with any tool,
which makes it the first phase of methods that search the design with a trained controller.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from codesign_bench.config.settings import Settings
from codesign_bench.learning.explorer import Explorer, UniformDesigns
from codesign_bench.learning.ppo_config import PerceptronConfig

from ._given_design import WITHOUT_EFFECT, GivenDesignMethod
from ._settings import SMALL_PERCEPTRONS, SMALL_PPO, ppo_settings


@dataclass(frozen=True, kw_only=True)
class Config(PerceptronConfig):
    """Hyperparameters of `random_tool`: PPO's and the perceptrons'."""

    not_searched: ClassVar = WITHOUT_EFFECT
    """Designs are drawn."""


class RandomTool(GivenDesignMethod[Config]):
    """A tool drawn uniformly in every episode, and PPO for a design-conditioned controller."""

    name = "random_tool"
    label = "random tool"
    config_class = Config

    @classmethod
    def small(cls) -> Mapping[str, Any]:
        """Return batches of a few episodes and small networks."""
        return {**SMALL_PPO, **SMALL_PERCEPTRONS}

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Settings:
        """Return PPO's settings."""
        return ppo_settings(profile, task_name)

    def give_designs(self, explorer: Explorer, steps: int, slots: int) -> tuple[Explorer, int]:
        """Let every episode draw its design."""
        return UniformDesigns(explorer), slots
