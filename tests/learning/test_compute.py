"""Updates on another device or in lower precision are the same updates up to rounding; nothing is left behind.

Torch's device "meta" computes shapes without numbers. An operation on tensors of two devices raises there as on a GPU,
so it shows without one that everything an update computes with has been moved.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from codesign_bench.learning.compute import BLOCK, Compute
from codesign_bench.learning.credit import Steps
from codesign_bench.learning.two_phase import TwoPhaseLearner
from codesign_bench.method import Problem, load_method
from codesign_bench.seeding import Streams
from codesign_bench.task import load_task
from double_precision import compute_in_double
from tolerances import DOUBLE, of_adam_step, of_sum

pytestmark = pytest.mark.numeric

MakeLearner = Callable[..., TwoPhaseLearner]
NEEDS_GPU = pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU here")
BACK_FROM_META = "Cannot copy out of meta tensor"


def tensors_of(learner: TwoPhaseLearner) -> list[torch.Tensor]:
    """Return all parameters, buffers and optimizer moments of a learner."""
    networks = [tensor for module in learner.modules().values() for tensor in (*module.parameters(), *module.buffers())]
    moments = [
        value for one in learner.optimizers.values() for values in one.state.values() for value in values.values()
    ]
    return networks + moments


@contextmanager
def visiting(learner: TwoPhaseLearner) -> Iterator[None]:
    """Bring a learner to the device without numbers; on the way back, that device has none to give.

    What fails in between is kept and raised in the end, for the way back would hide it.
    """
    holding, failures = learner.compute.holding(learner.modules(), learner.optimizers), list[BaseException]()
    with pytest.raises(NotImplementedError, match=BACK_FROM_META), holding:  # noqa: PT012  # It is `holding` that raises.
        try:
            yield
        except BaseException as failure:
            failures.append(failure)
    for failure in failures:
        raise failure


@pytest.fixture(params=["joint", "separate"])
def elsewhere(
    request: pytest.FixtureRequest, make_learner: MakeLearner, monkeypatch: pytest.MonkeyPatch
) -> TwoPhaseLearner:
    """A learner after its first batch, whose updates are to run on the device without numbers."""
    # Torch knows no reduced precision for this device, and refuses even to switch it off.
    monkeypatch.setattr(torch, "autocast", lambda *_, **__: nullcontext())
    learner = make_learner(batch_size=600, design_credit=request.param)
    learner.train(600)
    learner.use_device("meta")
    return learner


def test_networks_and_optimizers_visit_the_device_and_come_back(elsewhere: TwoPhaseLearner) -> None:
    before = len(tensors_of(elsewhere))
    assert {tensor.device.type for tensor in tensors_of(elsewhere)} == {"cpu"}
    with visiting(elsewhere):
        assert {tensor.device.type for tensor in tensors_of(elsewhere)} == {"meta"}
        assert len(tensors_of(elsewhere)) == before


def test_an_updates_losses_mix_no_devices(elsewhere: TwoPhaseLearner) -> None:
    batch = elsewhere.collect(600, 100)
    rows = np.arange(50)
    with visiting(elsewhere):
        steps = Steps.of(batch, elsewhere.compute)
        log_prob, entropy = elsewhere.credit.log_probs(steps)(rows)
        ratio = (log_prob - steps.log_prob[elsewhere.compute.tensor(rows)]).exp()
        values = elsewhere.compute.predict(elsewhere.value, steps.observation)
        (ratio.mean() + entropy + values.mean()).backward()  # type: ignore[no-untyped-call]
        gradients = [parameter.grad for parameter in elsewhere.value.parameters()]
        assert {gradient.device.type for gradient in gradients if gradient is not None} == {"meta"}


def test_mixing_devices_would_raise(elsewhere: TwoPhaseLearner) -> None:
    seen = torch.zeros(3, elsewhere.problem.task.layout.size)
    with visiting(elsewhere), pytest.raises(RuntimeError, match="not on the expected device"):
        elsewhere.value(seen)


def test_networks_come_back_after_an_error() -> None:
    compute, network = Compute(), torch.nn.Linear(2, 2)
    compute.use_device(torch.device("meta"))
    with pytest.raises(NotImplementedError, match=BACK_FROM_META), compute.holding({"network": network}, {}):
        raise KeyboardInterrupt


def test_on_the_processor_nothing_moves() -> None:
    compute, network = Compute(), torch.nn.Linear(2, 2)
    weights = network.weight.data_ptr()
    with compute.holding({"network": network}, {}):
        assert network.weight.data_ptr() == weights


def both(make_learner: MakeLearner, credit: str) -> tuple[TwoPhaseLearner, TwoPhaseLearner]:
    """Return a learner that updates on the processor and the same one that updates on a GPU."""
    here, there = (make_learner(design_credit=credit, batch_size=600, epochs=2) for _ in range(2))
    there.use_device("cuda")
    return here, there


@NEEDS_GPU
@pytest.mark.parametrize("credit", ["separate", "joint"])
def test_a_gpu_takes_the_same_steps_in_double_precision(
    make_learner: MakeLearner, monkeypatch: pytest.MonkeyPatch, credit: str
) -> None:
    here, there = both(make_learner, credit)
    for learner in (here, there):
        compute_in_double(monkeypatch, learner)
    batch, config = here.collect(600, 100), here.config
    for _ in range(2):
        expected, found = here.update(batch), there.update(batch)
        assert found == pytest.approx(expected, rel=1e-6)
    # No network takes more steps: 100 of the 600 rows are design steps, which have minibatches of their own.
    steps = 2 * max(
        config.epochs * 600 / config.minibatch_size, config.design_epochs * 100 / config.design_minibatch_size
    )
    # Networks of three layers of up to 16, and a mean over a minibatch whose terms are of order one.
    gradient_error = of_sum(2 * 3 * 16 + config.minibatch_size, unit=DOUBLE)
    tolerance = steps * of_adam_step(config.value_learning_rate, 1e-8, gradient_error)
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
    assert float((weights(there) - weights(here)).norm()) < 0.1 * float((weights(here) - start).norm())


@NEEDS_GPU
def test_a_learner_resumes_from_a_checkpoint_on_a_gpu(make_learner: MakeLearner) -> None:
    first, second = make_learner(), make_learner()
    for learner in (first, second):
        learner.use_device("cuda")
    first.train(60)
    second.load_state(first.state())
    second.streams.load_state(first.streams.state())
    # Not to the last bit: the order in which a GPU adds up may differ from run to run.
    assert first.train(60)[0].metrics == pytest.approx(second.train(60)[0].metrics, rel=1e-3)


def graph_learner(precision: str, credit: str) -> TwoPhaseLearner:
    """Return a small graph-network learner on push."""
    method: Any = load_method("gnn_ppo")
    small = {"batch_size": 700, "minibatch_size": 200, "epochs": 2, "kl_threshold": 1e9}
    config = replace(method.config_class(), **small, precision=precision, design_credit=credit)
    built: TwoPhaseLearner = method(Problem(load_task("push")), config, Streams(0)).learner
    return built


def weights(learner: TwoPhaseLearner) -> torch.Tensor:
    """Return all parameters of the learner's actor in one vector."""
    return torch.cat([parameter.detach().flatten() for parameter in learner.actor.parameters()])


@pytest.mark.parametrize("credit", ["joint", "separate"])
def test_both_precisions_learn_nearly_the_same(credit: str) -> None:
    single, reduced = graph_learner("fp32", credit), graph_learner("bf16", credit)
    start = weights(single)
    expected, found = (learner.train(700)[0].metrics for learner in (single, reduced))
    assert weights(reduced).dtype == torch.float32
    assert expected["policy_steps"] == found["policy_steps"] > 0
    moved = float((weights(single) - start).norm())
    apart = float((weights(single) - weights(reduced)).norm())
    # Adam moves a weight whose gradient is below its rounding error by whole steps, up or down: in bfloat16 a few of a
    # hundred weights, with a tenth or two of all movement (the root of a few hundredths). Updates that have nothing to
    # do with each other lie 1.4 times their movement apart.
    assert 0.0 < apart < 0.5 * moved
    # What follows from weights so far apart: the loss hardly changes with them, the divergence is a square of the
    # policy's movement.
    np.testing.assert_allclose(found["value_loss"], expected["value_loss"], rtol=0.2)
    np.testing.assert_allclose(found["kl"], expected["kl"], rtol=0.5, atol=1e-3)


@pytest.mark.parametrize(("precision", "rows", "padded"), [("fp32", 5, 5), ("bf16", 5, BLOCK), ("bf16", BLOCK, BLOCK)])
def test_in_bfloat16_rows_of_zeros_fill_a_block(precision: str, rows: int, padded: int) -> None:
    filled = Compute(precision).whole_blocks(torch.ones(rows, 3))
    assert filled.shape == (padded, 3)
    assert (filled[:rows] == 1.0).all()
    assert not filled[rows:].any()


def test_rows_that_fill_a_block_change_nothing() -> None:
    filled, bare = graph_learner("bf16", "joint"), graph_learner("bf16", "joint")
    bare.compute.block = 1
    start, batch = weights(bare), filled.collect(700, 5)
    expected, found = bare.update(batch), filled.update(batch)
    # For another number of rows the library may take another kernel, whose sums may round to neighbours in bfloat16.
    assert found["kl"] == pytest.approx(expected["kl"], rel=0.05)
    assert found["policy_steps"] == expected["policy_steps"]
    assert float((weights(filled) - weights(bare)).norm()) < 0.05 * float((weights(filled) - start).norm())


def test_in_bfloat16_networks_see_few_different_numbers_of_rows() -> None:
    learner, rows = graph_learner("bf16", "joint"), set[int]()
    batch = learner.collect(700, 5)
    for network in (learner.actor.designer, learner.actor.controller):  # type: ignore[union-attr]
        network.register_forward_hook(lambda module, inputs, output: rows.add(len(inputs[0])))  # type: ignore[union-attr]
    learner.update(batch)
    assert all(count % BLOCK == 0 for count in rows)
    assert 1 < len(rows) <= 5
