"""Stackelberg PPO: a designer that anticipates how the controller will adapt to its tools.

Source: Dai, Wang, Ashley and Schmidhuber (ICLR 2026, 2603.15388), who design one body for locomotion; a tool for each
goal is ours. Networks, settings and all of the controller's learning are those of `gnn_ppo` with separate credit, so
that the two differ in the response term alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from codesign_bench.learning.stackelberg import StackelbergConfig, StackelbergLearner
from codesign_bench.learning.two_phase import TwoPhaseLearner

from . import gnn_ppo


@dataclass(frozen=True, kw_only=True)
class Config(StackelbergConfig, gnn_ppo.Config):
    """Hyperparameters of `stackelberg_ppo`: those of `gnn_ppo`, and those of the response."""


class StackelbergPpo(gnn_ppo.GnnPpo):
    """Graph networks as in `gnn_ppo`; the designer leads and the controller follows."""

    name = "stackelberg_ppo"
    label = "Stackelberg PPO"
    config_class = Config  # type: ignore[assignment]  # one of its settings has fewer choices
    learner_class: ClassVar[type[TwoPhaseLearner]] = StackelbergLearner

    @classmethod
    def label_of(cls, config: gnn_ppo.Config) -> str:
        """Return the name: the credit is always separate."""
        return cls.label
