"""Policies of torch networks.

Shapes: `B` batch, `O` observation, `A` action.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor, nn

from codesign_bench.learning.checkpointing import module_arrays
from codesign_bench.method import Array, Policy
from codesign_bench.task import Singles

Act = Callable[[Tensor], Tensor]
"""Maps observations (B, O) to actions (B, A)."""


class NetworkPolicy(Policy):
    """A designer and a controller that are parts of one module, with actions clipped to [-1, 1]."""

    def __init__(self, network: nn.Module, design: Act, control: Act) -> None:
        self.network = network
        self._design, self._control = design, control

    @property
    def designer(self) -> Act:
        """The designer as a function of tensors; its designs are not clipped."""
        return self._design

    def design(self, observation: Singles) -> Singles:
        """Return the designer's design."""
        return _act(self._design, observation)

    def act(self, observation: Singles) -> Singles:
        """Return the controller's control."""
        return _act(self._control, observation)

    def tensors(self) -> dict[str, Array]:
        """Return parameters and normalisers of the module."""
        return module_arrays(self.network)


def _act(act: Act, observation: Singles) -> Singles:
    batch = np.atleast_2d(np.asarray(observation, dtype=np.float32))
    with torch.inference_mode():
        action: Singles = act(torch.from_numpy(batch)).clamp(-1.0, 1.0).numpy()
    return action if np.ndim(observation) == 2 else action[0]
