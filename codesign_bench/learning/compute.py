"""Device and precision of updates.

Shapes: `m` rows of a minibatch, `O` observation, `A` action.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import torch
from torch import Tensor, nn

from codesign_bench.learning.actor import Distribution
from codesign_bench.learning.checkpointing import Modules, Optimizers
from codesign_bench.learning.ppo_config import Precision
from codesign_bench.learning.residence import Residence

CPU = torch.device("cpu")
BLOCK = 64
"""Rows of observations are padded to multiples of this where kernels are compiled per shape (ours)."""


class Compute:
    """The device of a learner's updates, and the precision of their matrix products.

    Networks are on the CPU for rollouts; they are moved to the device for the duration of an update.
    """

    def __init__(self, precision: Precision = "fp32", block: int = BLOCK) -> None:
        self.precision, self.block = precision, block
        self.use_device(CPU)

    def use_device(self, device: torch.device) -> None:
        """Compute updates on a device."""
        self.device, self._residence = device, Residence(device)

    @property
    def reduced(self) -> bool:
        """Whether matrix products are computed in less than single precision."""
        return self.precision != "fp32"

    @contextmanager
    def holding(self, modules: Modules, optimizers: Optimizers) -> Iterator[None]:
        """Move networks and optimizers to the device, and back to the CPU at the end of the `with` block."""
        if self.device == CPU:
            yield
            return
        self._residence.enter(modules, optimizers)
        try:
            yield
        finally:
            self._residence.leave(modules, optimizers)

    def tensor(self, array: np.ndarray) -> Tensor:
        """Return an array as a tensor on the device."""
        return torch.from_numpy(array).to(self.device)

    def distribution(self, phase: Distribution, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean (m, A) and log standard deviation (A,) of a phase's actions for observations (m, O)."""
        with self._autocast():
            mean, log_std = phase(observation)
        # Back to single precision before anything is exponentiated: a ratio of probabilities is close to one, and
        # bfloat16 has steps of 1/128 there, a considerable part of the clipping range.
        return mean.float(), log_std

    def predict(self, network: Callable[[Tensor], Tensor], observation: Tensor) -> Tensor:
        """Return a value network's output (m,) for observations (m, O)."""
        with self._autocast():
            values = network(observation)
        return values.float()

    def whole_blocks(self, observation: Tensor) -> Tensor:
        """Return observations (m, O); in reduced precision, padded with rows of zeros to a multiple of the block.

        The number of design steps differs between minibatches, and the library behind reduced-precision products
        compiles and caches a kernel for every number of rows, which would take hundreds of megabytes.
        """
        missing = -len(observation) % self.block if self.reduced else 0
        return nn.functional.pad(observation, (0, 0, 0, missing)) if missing else observation

    def _autocast(self) -> torch.autocast:
        return torch.autocast(self.device.type, torch.bfloat16, enabled=self.reduced)
