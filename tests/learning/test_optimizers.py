"""Which parameters Adam trains, that its steps are those of PyTorch, and how step sizes fall."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from codesign_bench.learning.optimizers import Annealing, adam


def test_parameters_that_are_not_learned_are_left_out() -> None:
    learned, fixed = torch.nn.Parameter(torch.zeros(1)), torch.nn.Parameter(torch.zeros(1), requires_grad=False)
    (group,) = adam([learned, fixed], 0.1).param_groups
    assert group["params"] == [learned]
    assert group["lr"] == 0.1


def test_steps_and_state_are_those_of_pytorch() -> None:
    ours, theirs = (torch.nn.Parameter(torch.linspace(-1.0, 1.0, 7)) for _ in range(2))
    optimizers = [adam([ours], 0.1), torch.optim.Adam([theirs], lr=0.1, fused=adam([ours], 0.1).defaults["fused"])]
    for step in range(5):
        for parameter, optimizer in zip((ours, theirs), optimizers, strict=True):
            optimizer.zero_grad()
            (parameter**3).sum().backward()
            optimizer.step()
        if step == 2:  # a new optimizer resumes from the state of this one
            state = optimizers[0].state_dict()
            optimizers[0] = adam([ours], 0.5)
            optimizers[0].load_state_dict(state)
    np.testing.assert_array_equal(ours.detach().numpy(), theirs.detach().numpy())
    assert optimizers[0].param_groups[0]["lr"] == 0.1
    assert ours.requires_grad


@pytest.mark.parametrize(("done", "factor"), [(0.0, 1.0), (0.5, 0.6), (1.0, 0.2)])
def test_step_sizes_fall_linearly_each_from_its_own_start(done: float, factor: float) -> None:
    optimizers = {name: adam([torch.nn.Parameter(torch.zeros(1))], rate) for name, rate in (("a", 1.0), ("b", 3.0))}
    annealing = Annealing(optimizers, final_fraction=0.2)
    annealing.set(1.0)  # What was set before has no say.
    annealing.set(done)
    assert optimizers["a"].param_groups[0]["lr"] == pytest.approx(factor)
    assert optimizers["b"].param_groups[0]["lr"] == pytest.approx(3.0 * factor)
