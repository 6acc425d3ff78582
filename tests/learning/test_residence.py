"""Networks and optimizers return to the same memory on a device, and come back with what was computed there."""

from __future__ import annotations

import pytest
import torch

from codesign_bench.learning.optimizers import adam
from codesign_bench.learning.residence import Residence

NEEDS_GPU = pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU here")
DEVICES = ["cpu", pytest.param("cuda", marks=NEEDS_GPU)]
"""On the processor the same code runs: a tensor's memory is that of its first visit."""


def step(network: torch.nn.Module, optimizer: torch.optim.Optimizer, device: str) -> None:
    """Take one gradient step."""
    optimizer.zero_grad(set_to_none=True)
    network(torch.ones(1, 3, device=device)).sum().backward()
    optimizer.step()


def memory(network: torch.nn.Module, optimizer: torch.optim.Optimizer) -> list[int]:
    """Return where every weight and moment lies."""
    moments = [value for values in optimizer.state.values() for value in values.values()]
    return [tensor.data_ptr() for tensor in (*network.parameters(), *network.buffers(), *moments)]


@pytest.mark.parametrize("device", DEVICES)
def test_every_visit_is_to_the_same_memory(device: str) -> None:
    network, residence = torch.nn.Sequential(torch.nn.Linear(3, 2), torch.nn.BatchNorm1d(2).eval()), None
    optimizer = adam(network.parameters(), 0.1)
    residence, found = Residence(torch.device(device)), []
    for _ in range(3):
        residence.enter({"network": network}, {"adam": optimizer})
        step(network, optimizer, device)
        found.append(memory(network, optimizer))
        residence.leave({"network": network}, {"adam": optimizer})
        # What a checkpoint does: other tensors with the same values take their place on the processor.
        optimizer.load_state_dict(optimizer.state_dict())
        for tensor in (*network.parameters(), *network.buffers()):
            tensor.data = tensor.data.clone()
    assert found[0] == found[1] == found[2]


@pytest.mark.parametrize("device", DEVICES)
def test_what_was_computed_there_comes_back(device: str) -> None:
    networks = [torch.nn.Linear(3, 2) for _ in range(2)]
    networks[1].load_state_dict(networks[0].state_dict())
    optimizers, residence = [adam(network.parameters(), 0.1) for network in networks], Residence(torch.device(device))
    for _ in range(3):
        step(networks[0], optimizers[0], "cpu")
        residence.enter({"network": networks[1]}, {"adam": optimizers[1]})
        step(networks[1], optimizers[1], device)
        residence.leave({"network": networks[1]}, {"adam": optimizers[1]})
        assert networks[1].weight.device.type == "cpu"
        assert networks[1].weight.grad is None
    torch.testing.assert_close(networks[1].weight, networks[0].weight)
    for here, there in zip(*(optimizer.state.values() for optimizer in optimizers), strict=True):
        torch.testing.assert_close(there, here)
