"""Optimizers of PPO-based learners and the schedule of their step sizes."""

from __future__ import annotations

from collections.abc import Iterable

import torch
from torch import nn

from codesign_bench.learning.checkpointing import Optimizers


def adam(parameters: Iterable[nn.Parameter], learning_rate: float) -> torch.optim.Adam:
    """Return Adam (Kingma and Ba 2015) for those of `parameters` that are learned."""
    return torch.optim.Adam([p for p in parameters if p.requires_grad], lr=learning_rate, fused=True)


class Annealing:
    """Step sizes that fall linearly over the budget, from what they are now to a fraction of that."""

    def __init__(self, optimizers: Optimizers, final_fraction: float) -> None:
        self.optimizers, self.final_fraction = optimizers, final_fraction
        self._start = {name: optimizer.param_groups[0]["lr"] for name, optimizer in optimizers.items()}

    def set(self, done: float) -> None:
        """Set the step sizes for the time when the fraction `done` of the budget is used up."""
        factor = 1.0 - done * (1.0 - self.final_fraction)
        for name, optimizer in self.optimizers.items():
            optimizer.param_groups[0]["lr"] = self._start[name] * factor
