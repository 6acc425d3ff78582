"""A network as plain operations computes what torch computes, whatever it is made of, or is refused."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from codesign_bench.explorer.programs import LONG, UnknownOperation, program_of, rounded

SEEN = np.linspace(-1.0, 2.0, 6)


def torch_says(network: nn.Module) -> np.ndarray:
    """Return the network's own answer."""
    with torch.no_grad():
        answer: np.ndarray = network(torch.tensor(SEEN[None], dtype=torch.float32))[0].numpy()
    return answer


class Mixed(nn.Module):
    """Slices, concatenations, broadcasts, indices, batches of products and constants that need computing first."""

    def __init__(self) -> None:
        super().__init__()
        torch.manual_seed(0)
        self.batches = nn.Parameter(torch.randn(3, 2, 4))
        self.order = torch.tensor([2, 0, 1])
        self.variance = torch.rand(4)

    def forward(self, seen: Tensor) -> Tensor:
        pairs = seen.view(3, 1, 2)
        turned = torch.bmm(pairs, self.batches)[self.order].squeeze(1)
        scaled = torch.relu(turned * (self.variance + 1e-3).rsqrt() - 0.5)
        joined = torch.cat([scaled.t().reshape(1, -1), seen[:, 1:3].tanh().neg()], dim=1)
        return joined.clamp(-2.0, 1.5) / 2.0 + joined.sigmoid().exp()


def test_any_mixture_of_known_operations_gives_torchs_numbers() -> None:
    program = program_of(Mixed(), len(SEEN))
    np.testing.assert_allclose(program(SEEN), torch_says(Mixed()), atol=1e-5)
    assert program.reads


def test_a_constant_does_not_read_the_observation() -> None:
    value = torch.tensor([0.25, -0.5])
    program = program_of(lambda seen: value.expand(len(seen), -1).clamp(-1.0, 1.0), 6)
    assert not program.reads
    assert program(SEEN).tolist() == [0.25, -0.5]


def test_an_unknown_operation_is_refused() -> None:
    with pytest.raises(UnknownOperation, match="sin"):
        program_of(torch.sin, 6)


def test_only_weights_are_rounded_and_more_bits_are_nearer() -> None:
    network = nn.Sequential(nn.Linear(6, 100), nn.Tanh(), nn.Linear(100, 2))
    exact = program_of(network, 6)
    errors = [np.abs(exact.rounded(bits)(SEEN) - exact(SEEN)).max() for bits in (8, 14, 24)]
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 1e-6
    coarse = exact.rounded(2)
    short = [index for index, constant in enumerate(exact.constants) if constant.size < LONG]
    assert all(np.allclose(coarse.constants[index], exact.constants[index], atol=1e-6) for index in short)


def test_rounding_keeps_the_largest_value() -> None:
    step, values = rounded(np.array([-0.7, 0.1, 0.0]), 8)
    assert values[0] == pytest.approx(-127 * step) == pytest.approx(-0.7)
    assert rounded(np.zeros(2), 8)[1].tolist() == [0.0, 0.0]
