"""Which parameters Adam trains, and how step sizes fall."""

from __future__ import annotations

import pytest
import torch

from codesign_bench.learning.optimizers import Annealing, adam


def test_parameters_that_are_not_learned_are_left_out() -> None:
    learned, fixed = torch.nn.Parameter(torch.zeros(1)), torch.nn.Parameter(torch.zeros(1), requires_grad=False)
    (group,) = adam([learned, fixed], 0.1).param_groups
    assert group["params"] == [learned]
    assert group["lr"] == 0.1


@pytest.mark.parametrize(("done", "factor"), [(0.0, 1.0), (0.5, 0.6), (1.0, 0.2)])
def test_step_sizes_fall_linearly_each_from_its_own_start(done: float, factor: float) -> None:
    optimizers = {name: adam([torch.nn.Parameter(torch.zeros(1))], rate) for name, rate in (("a", 1.0), ("b", 3.0))}
    annealing = Annealing(optimizers, final_fraction=0.2)
    annealing.set(1.0)  # What was set before has no say.
    annealing.set(done)
    assert optimizers["a"].param_groups[0]["lr"] == pytest.approx(factor)
    assert optimizers["b"].param_groups[0]["lr"] == pytest.approx(3.0 * factor)
