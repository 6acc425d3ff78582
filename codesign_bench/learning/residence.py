"""Memory on a device in which a learner's networks and optimizers live during updates.

A CUDA graph reads and writes the addresses that it was captured with. So tensors must return to the same memory for
every update, which `Module.to` does not promise.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator

import torch
from torch import Tensor

from codesign_bench.learning.checkpointing import Modules, Optimizers


class Residence:
    """Moves networks and optimizers to a device and back; on the device, every tensor keeps its memory."""

    def __init__(self, device: torch.device) -> None:
        self.device = device
        self._places: dict[Hashable, Tensor] = {}

    def enter(self, modules: Modules, optimizers: Optimizers) -> None:
        """Move networks, and the moments and counts of their optimizers, to the device."""
        for name, module in modules.items():
            module.to(self.device)
            for key, tensor in (*module.named_parameters(), *module.named_buffers()):
                tensor.data = self._in_place((name, key), tensor.data)
        for place, values in _moments(optimizers):
            for key, value in values.items():
                values[key] = self._in_place((*place, key), value.to(self.device))

    def leave(self, modules: Modules, optimizers: Optimizers) -> None:
        """Move them back to the CPU; gradients are dropped."""
        for module in modules.values():
            module.zero_grad(set_to_none=True)
            module.to("cpu")
        for place, values in _moments(optimizers):
            for key, value in values.items():
                self._places.setdefault((*place, key), value)  # the first update has made it on the device
                values[key] = value.cpu()

    def _in_place(self, key: Hashable, values: Tensor) -> Tensor:
        """Return the memory of `key` with these values, which the first call gives it."""
        place = self._places.setdefault(key, values)
        if place is not values:
            place.copy_(values)
        return place


def _moments(optimizers: Optimizers) -> Iterator[tuple[tuple[str, int], dict[str, Tensor]]]:
    """Yield what every optimizer remembers of a parameter, with the optimizer's name and the parameter's index."""
    for name, optimizer in optimizers.items():
        parameters = (parameter for group in optimizer.param_groups for parameter in group["params"])
        for index, parameter in enumerate(parameters):
            if parameter in optimizer.state:
                yield (name, index), optimizer.state[parameter]
