"""An update on a GPU is the processor's update, up to rounding; rollouts and everything saved stay on the processor."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch

from codesign_bench.learning.two_phase import TwoPhaseLearner

MakeLearner = Callable[..., TwoPhaseLearner]
NEEDS_GPU = pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU here")


@NEEDS_GPU
@pytest.mark.parametrize("credit", ["separate", "joint"])
def test_a_gpu_gets_the_same_losses_for_the_same_batch(make_learner: MakeLearner, credit: str) -> None:
    here, there = (make_learner(design_credit=credit, batch_size=600, epochs=2) for _ in range(2))
    there.use_device("cuda")
    batch = here.collect(600, 100)
    for _ in range(2):
        expected, found = here.update(batch), there.update(batch)
        for name, value in expected.items():
            np.testing.assert_allclose(found[name], value, rtol=1e-2, atol=1e-4, err_msg=name)
    for name, array in here.state().arrays.items():
        np.testing.assert_allclose(there.state().arrays[name], array, rtol=1e-2, atol=1e-3, err_msg=name)


@NEEDS_GPU
def test_a_learner_goes_on_from_a_checkpoint_on_a_gpu(make_learner: MakeLearner) -> None:
    first, second = make_learner(), make_learner()
    for learner in (first, second):
        learner.use_device("cuda")
    first.train(60)
    second.load_state(first.state())
    second.streams.load_state(first.streams.state())
    assert first.train(60)[0].metrics == pytest.approx(second.train(60)[0].metrics, rel=1e-3)


def test_networks_and_optimizers_are_back_after_an_update(
    make_learner: MakeLearner, monkeypatch: pytest.MonkeyPatch
) -> None:
    learner = make_learner()
    moves: list[str] = []
    original = learner._move
    monkeypatch.setattr(learner, "_move", lambda device: (moves.append(device.type), original(torch.device("cpu"))))
    monkeypatch.setattr(learner, "_tensor", torch.from_numpy)  # The data stay here, too: only the order is looked at.
    learner.use_device("cuda")
    learner.train(60)
    assert moves == ["cuda", "cpu"]
    assert all(parameter.device.type == "cpu" for parameter in learner.actor.parameters())
