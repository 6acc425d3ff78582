"""Optimizers of PPO-based learners and their learning rate schedule."""

from __future__ import annotations

import inspect
from collections.abc import Iterable

import torch
from torch import nn

from codesign_bench.learning.checkpointing import Optimizers


class Adam(torch.optim.Adam):
    """PyTorch's Adam without its guards against the compiler, which nothing here uses.

    The guards import the compiler with the first optimizer of a process. That takes more than a second and 77 MB, as
    much as eight PyBullet worlds.
    """

    add_param_group = inspect.unwrap(torch.optim.Adam.add_param_group)
    state_dict = inspect.unwrap(torch.optim.Adam.state_dict)
    load_state_dict = inspect.unwrap(torch.optim.Adam.load_state_dict)
    zero_grad = inspect.unwrap(torch.optim.Adam.zero_grad)
    step = torch.no_grad()(inspect.unwrap(torch.optim.Adam.step))


def adam(parameters: Iterable[nn.Parameter], learning_rate: float) -> torch.optim.Adam:
    """Return Adam (Kingma and Ba 2015) for the trainable ones of `parameters`."""
    trainable = [p for p in parameters if p.requires_grad]
    try:
        return Adam(trainable, lr=learning_rate, fused=True)
    except RuntimeError:  # PyTorch before 2.4 can fuse the steps on GPUs alone
        return Adam(trainable, lr=learning_rate)


class Annealing:
    """Learning rates that decrease linearly over the budget to a fraction of their initial values."""

    def __init__(self, optimizers: Optimizers, final_fraction: float) -> None:
        self.optimizers, self.final_fraction = optimizers, final_fraction
        self._start = {name: optimizer.param_groups[0]["lr"] for name, optimizer in optimizers.items()}

    def set(self, done: float) -> None:
        """Set the learning rates for the time when the fraction `done` of the budget is used."""
        factor = 1.0 - done * (1.0 - self.final_fraction)
        for name, optimizer in self.optimizers.items():
            optimizer.param_groups[0]["lr"] = self._start[name] * factor
