"""A policy of networks takes one observation or several, clips actions, and is described by its module's arrays."""

from __future__ import annotations

import numpy as np
import torch

from codesign_bench.learning.network_policy import NetworkPolicy

SEEN = np.array([[0.5, 0.0], [3.0, -3.0]], np.float32)


def make() -> NetworkPolicy:
    """Return a policy that designs the sum of its inputs and does the opposite."""
    network = torch.nn.Linear(2, 1)
    with torch.no_grad():
        network.weight.fill_(1.0)
        network.bias.zero_()
    return NetworkPolicy(network, network, lambda seen: -network(seen) - seen[:, :1])


def test_actions_are_clipped() -> None:
    np.testing.assert_array_equal(make().design(SEEN), [[0.5], [0.0]])
    np.testing.assert_array_equal(make().act(SEEN), [[-1.0], [-1.0]])


def test_the_designer_itself_does_not_clip() -> None:
    assert make().designer(torch.tensor([[3.0, 1.0]])).tolist() == [[4.0]]


def test_one_observation_gives_one_action() -> None:
    assert make().design(SEEN[0]).tolist() == [0.5]
    assert make().act(SEEN[1]).shape == (1,)


def test_tensors_are_copies_of_the_modules() -> None:
    policy = make()
    tensors = policy.tensors()
    assert tensors.keys() == {"weight", "bias"}
    tensors["weight"][:] = 7.0
    assert policy.design(SEEN[0]).tolist() == [0.5]
