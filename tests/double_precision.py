"""A learner that computes in double precision, for comparisons that rounding must not blur."""

from __future__ import annotations

import numpy as np
import pytest
from torch import Tensor

from codesign_bench.learning.two_phase import TwoPhaseLearner


def compute_in_double(monkeypatch: pytest.MonkeyPatch, learner: TwoPhaseLearner) -> None:
    """Let a learner's updates compute in double precision, also where they would round to single.

    The code is the same in either precision: what is wrong in one is wrong in the other. Here it stands out, since
    rounding is a thousand million times smaller.
    """
    compute = learner.compute
    tensor = compute.tensor

    def widened(array: np.ndarray) -> Tensor:
        made = tensor(array)
        return made.double() if made.is_floating_point() else made

    monkeypatch.setattr(compute, "tensor", widened)
    monkeypatch.setattr(Tensor, "float", Tensor.double)
    for module in learner.modules().values():
        module.double()
