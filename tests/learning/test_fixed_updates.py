"""Updates of fixed shape take the steps of the ordinary ones; here on the processor, where nothing is replayed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch

from codesign_bench.learning.credit import Steps
from codesign_bench.learning.fixed_updates import BLOCK, ROWS_BLOCK, Batch, Buffers, Places, padded, weighted_mean
from codesign_bench.learning.optimizers import adam
from codesign_bench.learning.ppo_config import PPOConfig
from codesign_bench.learning.trajectories import Trajectories
from codesign_bench.learning.two_phase import TwoPhaseLearner
from double_precision import compute_in_double
from tolerances import DOUBLE, SINGLE, of_adam_step, of_sum

pytestmark = pytest.mark.numeric

TAKES_STEPS = pytest.mark.skipif(
    not adam([torch.nn.Parameter(torch.zeros(1))], 1.0).defaults["fused"],
    reason="on a processor, PyTorch before 2.4 has no fused Adam, by which steps are left out",
)
MakeLearner = Callable[..., TwoPhaseLearner]
SETTINGS: dict[str, dict[str, Any]] = {
    "separate": {"design_credit": "separate"},
    "joint": {"design_credit": "joint"},
    # Of 120 rows about 20 are design steps: the first minibatch holds nothing else, and most hold none.
    "joint, designs first": {"design_credit": "joint", "batch_design": True, "minibatch_size": 15},
    "joint, few rows": {"design_credit": "joint", "minibatch_size": 2},
    "learned deviations": {"design_credit": "joint", "fix_std": False, "entropy_weight": 0.1},
    "stopped": {"design_credit": "joint", "kl_threshold": 0.0004, "epochs": 6},
    "clipped": {"design_credit": "separate", "max_gradient_norm": 0.05},
}


def pair(make_learner: MakeLearner, monkeypatch: pytest.MonkeyPatch, **settings: Any) -> list[TwoPhaseLearner]:
    """Return an ordinary learner and one with updates of fixed shape, alike in all else and in double precision."""
    plain, fixed = (make_learner(**{"batch_size": 120, "epochs": 2, **settings}) for _ in range(2))
    fixed.fixed = fixed._make_fixed()
    for learner in (plain, fixed):
        compute_in_double(monkeypatch, learner)
    return [plain, fixed]


def batch_of(learner: TwoPhaseLearner, rows: int) -> Batch:
    """Return a batch of so many rows, all of whose numbers are log-probabilities."""
    steps = Steps.of(learner.collect(rows, rows // 6), learner.compute)
    return Batch(steps, steps.log_prob, steps.log_prob, steps.log_prob)


@TAKES_STEPS
@pytest.mark.parametrize("name", SETTINGS)
def test_they_take_the_same_steps(name: str, make_learner: MakeLearner, monkeypatch: pytest.MonkeyPatch) -> None:
    plain, fixed = pair(make_learner, monkeypatch, **SETTINGS[name])
    config: PPOConfig = plain.config
    metrics: list[dict[str, float]] = []
    for steps in (120, 90, 150):  # fewer and more rows than before
        batch: Trajectories = plain.collect(steps, steps // 6)
        metrics, found = [*metrics, plain.update(batch)], fixed.update(batch)
        assert found == pytest.approx(metrics[-1], rel=1e-5, abs=1e-9)
    # No network takes more steps than there are minibatches; the learning rate is stored in single precision.
    steps = config.epochs * (120 + 90 + 150) / min(config.minibatch_size, 10)
    error = of_sum(2 * 3 * 16 + config.minibatch_size, unit=DOUBLE)
    tolerance = steps * (of_adam_step(config.value_learning_rate, 1e-8, error) + config.value_learning_rate * SINGLE)
    for key, array in plain.state().arrays.items():
        np.testing.assert_allclose(fixed.state().arrays[key], array, rtol=1e-5, atol=tolerance, err_msg=key)
    if name == "stopped":
        assert all(0 < found["policy_steps"] < config.epochs * 6 for found in metrics)


@TAKES_STEPS
def test_the_learning_rate_may_change_between_batches(make_learner: MakeLearner) -> None:
    learner = make_learner(design_credit="joint", batch_size=600)
    learner.fixed = learner._make_fixed()
    optimizer = learner.optimizers["policy"]
    learner.update(learner.collect(600, 100))
    assert optimizer.param_groups[0]["lr"] == learner.config.policy_learning_rate  # a plain number again
    before = [parameter.detach().clone() for parameter in learner.actor.parameters()]
    optimizer.param_groups[0]["lr"] = 0.0
    learner.update(learner.collect(600, 100))
    for parameter, expected in zip(learner.actor.parameters(), before, strict=True):
        assert torch.equal(parameter, expected)


def test_minibatches_are_padded() -> None:
    index, weight = padded([[np.array([4, 2]), np.array([7])], [np.array([5]), np.array([6])]], widths=(3, 2))
    assert index.tolist() == [[4, 2, 0, 7, 0], [5, 0, 0, 6, 0]]
    assert weight.tolist() == [[1, 1, 0, 1, 0], [1, 0, 0, 1, 0]]


def test_padding_counts_in_no_mean() -> None:
    assert weighted_mean(torch.tensor([1.0, 3.0, 100.0]), torch.tensor([1.0, 1.0, 0.0])).item() == 2.0


def test_minibatches_come_in_turn() -> None:
    places = Places(torch.device("cpu"))
    places.load([[np.array([4, 2])], [np.array([5])]])
    taken = [places.take() for _ in range(2)]
    assert [index[weight > 0].tolist() for index, weight in taken] == [[4, 2], [5]]


def test_shapes_change_only_to_grow() -> None:
    places = Places(torch.device("cpu"))
    assert places.load([[np.arange(10)]] * 3)
    assert not places.load([[np.arange(BLOCK)]] * 5)
    assert places.widths == (BLOCK,)
    assert places.load([[np.arange(BLOCK + 1)]])
    assert not places.load([[np.arange(2)]])
    assert places.widths == (2 * BLOCK,)
    assert places.load([[np.arange(2)]] * (BLOCK + 1))


def test_a_batch_goes_into_the_memory_of_the_one_before(make_learner: MakeLearner) -> None:
    learner, buffers = make_learner(design_credit="joint"), Buffers()
    batches = [batch_of(learner, steps) for steps in (60, 54, ROWS_BLOCK + 1)]
    held = [buffers.hold(batch) for batch in batches]
    assert [moved for _, moved in held] == [True, False, True]
    first, second, third = (kept.steps.observation for kept, _ in held)
    assert first.data_ptr() == second.data_ptr()
    assert (len(first), len(third)) == (ROWS_BLOCK, 2 * ROWS_BLOCK)
    for batch, (kept, _) in zip(batches[1:], held[1:], strict=True):
        assert torch.equal(kept.steps.control[: len(batch.advantage)], batch.steps.control)
        assert np.array_equal(kept.steps.designing, batch.steps.designing)
