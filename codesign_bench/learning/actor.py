"""The actor of a two-phase learner: a Gaussian over designs and one over controls.

Shapes: `B` batch, `O` observation, `D` design, `C` control.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from codesign_bench.learning.checkpointing import module_arrays
from codesign_bench.method import Policy
from codesign_bench.task import Singles


class Actor(nn.Module):
    """Designer and controller. `fix_std` decides whether the log standard deviations are learned."""

    design_log_std: nn.Parameter
    control_log_std: nn.Parameter

    def add_log_stds(self, design: int, control: int, design_log_std: float, control_log_std: float, fix: bool) -> None:
        """Add one log standard deviation per design parameter and per control, learned unless `fix`."""
        self.design_log_std = nn.Parameter(torch.full((design,), design_log_std), requires_grad=not fix)
        self.control_log_std = nn.Parameter(torch.full((control,), control_log_std), requires_grad=not fix)

    @abstractmethod
    def design(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean (B, D) and log standard deviation (D,) of the designs for observations (B, O)."""

    @abstractmethod
    def control(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean (B, C) and log standard deviation (C,) of the controls for observations (B, O)."""

    @abstractmethod
    def design_parameters(self) -> list[nn.Parameter]:
        """Return the parameters that the design step's loss trains."""

    @abstractmethod
    def control_parameters(self) -> list[nn.Parameter]:
        """Return the parameters that the control steps' loss trains."""

    @abstractmethod
    def update_statistics(self, observation: Tensor, is_design: Tensor) -> None:
        """Take a batch's observations (B, O) into the running normalisation; `is_design` (B,) marks design steps."""


class ActorPolicy(Policy):
    """An actor that acts with its means, clipped to [-1, 1]."""

    def __init__(self, actor: Actor) -> None:
        self.actor = actor

    def design(self, observation: Singles) -> Singles:
        """Return the mean design."""
        return self._mean(self.actor.design, observation)

    def act(self, observation: Singles) -> Singles:
        """Return the mean control."""
        return self._mean(self.actor.control, observation)

    def tensors(self) -> dict[str, Any]:
        """Return the actor's parameters and normalisers."""
        return module_arrays(self.actor)

    @staticmethod
    def _mean(distribution: Any, observation: Singles) -> Singles:
        batch = np.atleast_2d(np.asarray(observation, dtype=np.float32))
        with torch.inference_mode():
            mean: Singles = distribution(torch.from_numpy(batch))[0].clamp(-1.0, 1.0).numpy()
        return mean if np.ndim(observation) == 2 else mean[0]
