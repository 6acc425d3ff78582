"""Networks and optimizers survive as arrays: restored ones take the same next step, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from codesign_bench.errors import ChangedTaskError
from codesign_bench.learning.checkpointing import learner_arrays, load_learner_arrays, load_module_arrays, module_arrays
from codesign_bench.learning.networks import RunningNorm
from codesign_bench.learning.optimizers import adam

INPUTS = torch.linspace(-1.0, 1.0, 12).view(4, 3)


def make(seed: int) -> tuple[dict[str, torch.nn.Module], dict[str, torch.optim.Optimizer]]:
    """Return a small network with its optimizer, each by name."""
    network = torch.nn.Linear(3, 2)
    with torch.no_grad():
        network.weight.normal_(generator=torch.Generator().manual_seed(seed))
        network.bias.zero_()
    return {"network": network}, {"network": adam(network.parameters(), 0.1)}


def step(modules: dict[str, torch.nn.Module], optimizers: dict[str, torch.optim.Optimizer]) -> None:
    """Take one gradient step."""
    optimizers["network"].zero_grad()
    (modules["network"](INPUTS) ** 2).sum().backward()
    optimizers["network"].step()


def test_a_restored_learner_takes_the_same_next_step() -> None:
    first, second = make(0), make(1)
    for _ in range(3):
        step(*first)
    load_learner_arrays(*second, learner_arrays(*first))
    for parts in (first, second):
        step(*parts)
    arrays, others = learner_arrays(*first), learner_arrays(*second)
    assert arrays.keys() == others.keys()
    assert {"network.weight", "optimizer.network.0.exp_avg"} <= arrays.keys()
    for name, array in arrays.items():
        np.testing.assert_array_equal(array, others[name], err_msg=name)


def test_arrays_are_copies() -> None:
    modules, optimizers = make(0)
    arrays = learner_arrays(modules, optimizers)
    kept = arrays["network.weight"].copy()
    step(modules, optimizers)
    np.testing.assert_array_equal(arrays["network.weight"], kept)


@pytest.mark.parametrize("change", [{"weight": None}, {"weight": np.zeros((5, 3), np.float32)}])
def test_arrays_of_another_network_are_refused(change: dict[str, np.ndarray | None]) -> None:
    network = make(0)[0]["network"]
    arrays = {name: array for name, array in (module_arrays(network) | change).items() if array is not None}
    with pytest.raises(RuntimeError):
        load_module_arrays(network, arrays)


def test_arrays_that_were_trained_with_another_observation_are_refused_as_such() -> None:
    before, after = (torch.nn.Sequential(RunningNorm([0.0] * size, [1.0] * size)) for size in (3, 5))
    with pytest.raises(ChangedTaskError, match="another observation: 3 entries of state and goal, now 5"):
        load_module_arrays(after, module_arrays(before))
