"""The interface of everything that acts in an episode: a designer and a controller.

Shapes: `B` batch, `O` observation, `D` design, `C` control.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from codesign_bench.task.spaces import Singles


class Behaviour(ABC):
    """A designer and a controller as functions of the observation: a task's script or a trained policy."""

    @abstractmethod
    def design(self, observation: Singles) -> Singles:
        """Return the design (D,) or (B, D) in [-1, 1] for an observation (O,) or (B, O) of the design phase."""

    @abstractmethod
    def act(self, observation: Singles) -> Singles:
        """Return the control (C,) or (B, C) in [-1, 1] for an observation (O,) or (B, O) of the control phase."""
