"""An update in bfloat16 learns nearly what the one in single precision does, and leaves weights in single precision."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from codesign_bench.learning.two_phase import BLOCK, TwoPhaseLearner
from codesign_bench.method import Problem, load_method
from codesign_bench.seeding import Streams
from codesign_bench.task import load_task

pytestmark = pytest.mark.numeric


def learner(precision: str, credit: str) -> TwoPhaseLearner:
    """Return a small graph-network learner on push."""
    method = load_method("gnn_ppo")
    small = {"batch_size": 700, "minibatch_size": 200, "epochs": 2, "kl_threshold": 1e9}
    config = replace(method.config_class(), **small, precision=precision, design_credit=credit)
    built: TwoPhaseLearner = method(Problem(load_task("push")), config, Streams(0)).learner  # type: ignore[attr-defined]
    return built


@pytest.mark.parametrize("credit", ["joint", "separate"])
def test_both_precisions_learn_nearly_the_same(credit: str) -> None:
    learners = {precision: learner(precision, credit) for precision in ("fp32", "bf16")}
    start = torch.cat([p.detach().flatten() for p in learners["fp32"].actor.parameters()])
    metrics = {precision: one.train(700)[0].metrics for precision, one in learners.items()}
    weights = {
        name: torch.cat([p.detach().flatten() for p in one.actor.parameters()]) for name, one in learners.items()
    }
    assert weights["bf16"].dtype == torch.float32
    assert metrics["fp32"]["policy_steps"] == metrics["bf16"]["policy_steps"] > 0
    moved = float((weights["fp32"] - start).norm())
    apart = float((weights["fp32"] - weights["bf16"]).norm())
    # Adam moves a weight whose gradient is below its rounding error by whole steps, up or down: in bfloat16 a few of a
    # hundred weights, with a tenth or two of all movement (the root of a few hundredths). Updates that have nothing to
    # do with each other lie 1.4 times their movement apart.
    assert 0.0 < apart < 0.5 * moved
    # What follows from weights so far apart: the loss hardly changes with them, the divergence is a square of the
    # policy's movement.
    np.testing.assert_allclose(metrics["bf16"]["value_loss"], metrics["fp32"]["value_loss"], rtol=0.2)
    np.testing.assert_allclose(metrics["bf16"]["kl"], metrics["fp32"]["kl"], rtol=0.5, atol=1e-3)


@pytest.mark.parametrize(("precision", "whole"), [("fp32", False), ("bf16", True)])
def test_in_bfloat16_networks_see_few_different_numbers_of_rows(precision: str, whole: bool) -> None:
    one, rows = learner(precision, "joint"), set[int]()
    for phase in (one.actor.design, one.actor.control):

        def watched(observation: torch.Tensor, phase: Any = phase) -> Any:
            rows.add(len(observation))
            return phase(observation)

        setattr(one.actor, phase.__name__, watched)
    batch = one.collect(700, 5)
    rows.clear()
    one.update(batch)
    assert all(count % BLOCK == 0 for count in rows) == whole
    assert len(rows) <= 5 or not whole


def test_rows_that_fill_a_block_change_nothing() -> None:
    filled, bare = learner("bf16", "joint"), learner("bf16", "joint")
    bare._full_blocks = lambda observation: observation  # type: ignore[method-assign]
    batch = filled.collect(700, 5)
    metrics = [one.update(batch) for one in (filled, bare)]
    # For another number of rows the library may take another kernel, whose sums may round to neighbours in bfloat16.
    assert metrics[0]["kl"] == pytest.approx(metrics[1]["kl"], rel=0.05)
    assert metrics[0]["policy_steps"] == metrics[1]["policy_steps"]
    weights = [torch.cat([p.detach().flatten() for p in one.actor.parameters()]) for one in (filled, bare)]
    start = torch.cat([p.detach().flatten() for p in learner("bf16", "joint").actor.parameters()])
    assert float((weights[0] - weights[1]).norm()) < 0.05 * float((weights[0] - start).norm())


def test_an_unknown_precision_is_refused() -> None:
    with pytest.raises(ValueError, match="precision is 'fp32' or 'bf16', not 'half'"):
        learner("half", "joint")
