"""An update on a GPU is the processor's update, up to rounding; rollouts and everything saved stay on the processor."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch

from codesign_bench.learning.two_phase import TwoPhaseLearner
from double_precision import compute_in_double
from tolerances import DOUBLE, of_adam_step, of_sum

MakeLearner = Callable[..., TwoPhaseLearner]
NEEDS_GPU = pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU here")


@NEEDS_GPU
@pytest.mark.parametrize("credit", ["separate", "joint"])
def test_a_gpu_takes_the_same_steps_in_double_precision(
    make_learner: MakeLearner, monkeypatch: pytest.MonkeyPatch, credit: str
) -> None:
    here, there = both(make_learner, credit)
    for learner in (here, there):
        compute_in_double(monkeypatch, learner)
    batch, steps = here.collect(600, 100), 0.0
    for _ in range(2):
        expected, found = here.update(batch), there.update(batch)
        assert found == pytest.approx(expected, rel=1e-6)
        steps += 2 * 600 / here.config.minibatch_size
    # Networks of three layers of up to 16, and a mean over a minibatch whose terms are of order one.
    gradient_error = of_sum(2 * 3 * 16 + here.config.minibatch_size, unit=DOUBLE)
    tolerance = steps * of_adam_step(here.config.value_learning_rate, 1e-8, gradient_error)
    for name, array in here.state().arrays.items():
        np.testing.assert_allclose(there.state().arrays[name], array, rtol=1e-6, atol=tolerance, err_msg=name)


@NEEDS_GPU
@pytest.mark.parametrize("credit", ["separate", "joint"])
def test_a_gpu_gets_the_same_losses_for_the_same_batch(make_learner: MakeLearner, credit: str) -> None:
    here, there = both(make_learner, credit)
    batch, start = here.collect(600, 100), weights(here)
    for _ in range(2):
        expected, found = here.update(batch), there.update(batch)
        for name, value in expected.items():
            np.testing.assert_allclose(found[name], value, rtol=1e-2, atol=1e-4, err_msg=name)
    # Single weights whose gradients are tiny may differ by whole steps; all together they hardly do.
    assert np.linalg.norm(weights(there) - weights(here)) < 0.1 * np.linalg.norm(weights(here) - start)


def both(make_learner: MakeLearner, credit: str) -> tuple[TwoPhaseLearner, TwoPhaseLearner]:
    """Return a learner that updates on the processor and the same one that updates on a GPU."""
    here, there = (make_learner(design_credit=credit, batch_size=600, epochs=2) for _ in range(2))
    there.use_device("cuda")
    return here, there


def weights(learner: TwoPhaseLearner) -> np.ndarray:
    """Return all of an actor's weights in one array."""
    return torch.cat([parameter.detach().flatten() for parameter in learner.actor.parameters()]).numpy().copy()


@NEEDS_GPU
def test_a_learner_goes_on_from_a_checkpoint_on_a_gpu(make_learner: MakeLearner) -> None:
    first, second = make_learner(), make_learner()
    for learner in (first, second):
        learner.use_device("cuda")
    first.train(60)
    second.load_state(first.state())
    second.streams.load_state(first.streams.state())
    # Not to the last bit: the order in which a GPU adds up may differ from run to run.
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
