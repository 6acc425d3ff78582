"""The clipped loss, its limits and its helpers, by hand numbers. Shapes: `m` rows of a minibatch."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from codesign_bench.learning.ppo import (
    PolicyLoss,
    PolicyUpdate,
    ValueUpdate,
    gaussian,
    gradient_step,
    minibatches,
    normalized,
)
from tolerances import of_sum

pytestmark = pytest.mark.numeric

LOSS = PolicyLoss(clip_ratio=0.2, entropy_weight=0.0, kl_threshold=0.05, max_gradient_norm=40.0)


ROUNDED = of_sum(8)
"""A loss by hand: a logarithm, its exponential, a product or two and a mean, each rounded once, on either side."""


def loss_of(ratios: list[float], advantages: list[float], loss: PolicyLoss = LOSS, entropy: float = 0.0) -> float:
    """Return the loss of rows with the given probability ratios and advantages."""
    zero = torch.zeros(len(ratios))
    value, _ = loss(torch.tensor(ratios).log(), zero, torch.tensor(advantages), torch.tensor(entropy))
    return float(value)


@pytest.mark.parametrize(
    ("ratio", "advantage", "expected"),
    [
        (1.0, 3.0, -3.0),
        (1.1, 2.0, -2.2),
        (1.5, 2.0, -2.4),  # A good action made likelier counts up to 1.2 only,
        (0.5, 2.0, -1.0),  # but made rarer it counts in full.
        (0.5, -2.0, 1.6),  # A bad action made rarer counts down to 0.8 only,
        (1.5, -2.0, 3.0),  # but made likelier it counts in full.
    ],
)
def test_the_clipped_loss_by_hand(ratio: float, advantage: float, expected: float) -> None:
    assert loss_of([ratio], [advantage]) == pytest.approx(expected, rel=ROUNDED)


def test_the_loss_is_a_mean_minus_the_entropy_bonus() -> None:
    bonus = PolicyLoss(clip_ratio=0.2, entropy_weight=0.1, kl_threshold=1.0, max_gradient_norm=1.0)
    assert loss_of([1.5, 0.5], [2.0, -2.0]) == pytest.approx((-2.4 + 1.6) / 2.0, abs=2.4 * ROUNDED)
    assert loss_of([1.5, 0.5], [2.0, -2.0], bonus, entropy=3.0) == pytest.approx(-0.4 - 0.3, abs=2.4 * ROUNDED)


def test_a_good_action_becomes_likelier() -> None:
    mean = torch.zeros(1, requires_grad=True)
    log_prob, entropy = gaussian(mean.expand(1, 1), torch.zeros(1), torch.tensor([[1.0]]))
    loss, _ = LOSS(log_prob, log_prob.detach(), torch.tensor([2.0]), entropy)
    loss.backward()
    assert mean.grad is not None
    assert mean.grad.item() == pytest.approx(-2.0), "descent moves the mean towards the action, at 1, by the advantage"


def test_the_divergence_by_hand() -> None:
    new, old = torch.tensor([1.25, 0.5]).log(), torch.zeros(2)
    _, divergence = LOSS(new, old, torch.ones(2), torch.tensor(0.0))
    by_hand = ((0.25 - math.log(1.25)) + (-0.5 - math.log(0.5))) / 2.0
    assert divergence == pytest.approx(by_hand, abs=1.25 * ROUNDED)  # Numbers around one all but cancel.


def test_the_divergence_estimates_the_true_one() -> None:
    generator = torch.Generator().manual_seed(0)
    old = torch.distributions.Normal(torch.tensor(0.0), torch.tensor(1.0))
    new = torch.distributions.Normal(torch.tensor(0.3), torch.tensor(0.9))
    action = torch.randn(200_000, generator=generator)
    _, divergence = LOSS(new.log_prob(action), old.log_prob(action), action, torch.tensor(0.0))
    assert divergence == pytest.approx(float(torch.distributions.kl_divergence(old, new)), rel=0.05)


def shifting_policy(step: float) -> tuple[torch.nn.Parameter, PolicyUpdate]:
    """Return a one-parameter policy and its update: two rows with action 1 and advantage 1; plain descent by `step`."""
    mean = torch.nn.Parameter(torch.zeros(1))
    action = torch.ones(2, 1)
    old, _ = gaussian(torch.zeros(2, 1), torch.zeros(1), action)
    update = PolicyUpdate(
        LOSS,
        lambda rows: gaussian(mean.expand(len(rows), 1), torch.zeros(1), action[torch.from_numpy(rows)]),
        torch.optim.SGD([mean], lr=step),
        old,
        torch.ones(2),
    )
    return mean, update


def test_the_policy_stops_for_good_at_the_divergence_limit() -> None:
    mean, update = shifting_policy(step=1.0)
    rows = np.array([0, 1])
    update.step(rows)
    assert (update.steps, update.stopped) == (1, False)
    moved = mean.item()
    assert moved == pytest.approx(1.0)
    update.step(rows)
    assert update.divergence > LOSS.kl_threshold
    assert (update.steps, update.stopped, mean.item()) == (1, True, moved)
    with torch.no_grad():
        mean.zero_()  # Back below the limit: it stays stopped.
    update.step(rows)
    assert (update.steps, mean.item()) == (1, 0.0)


def test_small_steps_do_not_stop() -> None:
    mean, update = shifting_policy(step=0.01)
    for _ in range(5):
        update.step(np.array([0, 1]))
    assert (update.steps, update.stopped) == (5, False)
    assert mean.item() > 0.04


def test_the_value_regresses_on_its_target() -> None:
    network = torch.nn.Linear(1, 1)
    with torch.no_grad():
        network.weight.fill_(0.0)
        network.bias.fill_(0.0)

    class Flat(torch.nn.Module):
        """Maps (m, 1) to (m,)."""

        def __init__(self) -> None:
            super().__init__()
            self.layer = network

        def forward(self, x: torch.Tensor) -> torch.Tensor:
            """Apply the layer."""
            return self.layer(x)[:, 0]

    observation, target = torch.zeros(4, 1), torch.tensor([1.0, 1.0, 3.0, 3.0])
    update = ValueUpdate(Flat(), torch.optim.SGD(network.parameters(), lr=0.5), observation, target, max_norm=40.0)
    update.step(np.arange(4))
    assert update.loss == pytest.approx((1.0 + 1.0 + 9.0 + 9.0) / 4.0)
    assert network.bias.item() == pytest.approx(2.0)  # The gradient is -2 * mean target = -4; half of it is taken.


@pytest.mark.parametrize(("max_norm", "expected"), [(1.0, [-0.6, -0.8]), (100.0, [-3.0, -4.0])])
def test_gradients_are_clipped_to_a_norm(max_norm: float, expected: list[float]) -> None:
    parameter = torch.nn.Parameter(torch.zeros(2))
    loss = (parameter * torch.tensor([3.0, 4.0])).sum()
    gradient_step(loss, torch.optim.SGD([parameter], lr=1.0), [parameter], max_norm)
    # Squares, their root and a quotient; the norm, 5, is divided by with 1e-6 added.
    np.testing.assert_allclose(parameter.detach().numpy(), expected, rtol=1e-6 / 5.0 + of_sum(5))


@pytest.mark.parametrize(("count", "size", "parts"), [(10, 5, 2), (10, 4, 2), (7, 100, 1), (1, 1, 1), (1001, 100, 10)])
def test_minibatches_are_a_partition_into_near_equal_parts(count: int, size: int, parts: int) -> None:
    found = list(minibatches(count, size, np.random.default_rng(0)))
    assert len(found) == parts
    assert sorted(np.concatenate(found).tolist()) == list(range(count))
    assert max(map(len, found)) - min(map(len, found)) <= 1


def test_marked_rows_fill_the_first_minibatches() -> None:
    marked = np.isin(np.arange(10), [2, 3, 5, 9])
    one, two, three, four, five = minibatches(10, 2, np.random.default_rng(0), marked)
    assert {*one.tolist(), *two.tolist()} == {2, 3, 5, 9}
    assert {*three.tolist(), *four.tolist(), *five.tolist()} == {0, 1, 4, 6, 7, 8}
    mixed, rest = minibatches(10, 5, np.random.default_rng(0), marked)
    assert {2, 3, 5, 9} < set(mixed.tolist())
    assert sorted([*mixed.tolist(), *rest.tolist()]) == list(range(10))


def test_marked_rows_and_the_others_keep_the_order_that_they_have_without_marks() -> None:
    marked = np.arange(10) >= 6
    plain, sorted_ = (
        np.concatenate(list(minibatches(10, 5, np.random.default_rng(1), first))).tolist() for first in (None, marked)
    )
    assert sorted_ == [row for row in plain if row >= 6] + [row for row in plain if row < 6]
    assert sorted_[:4] != sorted(sorted_[:4])


def test_minibatches_are_shuffled_anew() -> None:
    rng = np.random.default_rng(0)
    first, second = (np.concatenate(list(minibatches(50, 10, rng))).tolist() for _ in range(2))
    assert first != second
    assert first != list(range(50))


def test_gaussian_equals_torchs_distribution() -> None:
    generator = torch.Generator().manual_seed(0)
    mean, action = torch.randn(6, 3, generator=generator), torch.randn(6, 3, generator=generator)
    log_std = torch.tensor([-1.0, 0.0, 0.5])
    reference = torch.distributions.Independent(torch.distributions.Normal(mean, log_std.exp()), 1)
    log_prob, entropy = gaussian(mean, log_std, action)
    expected = reference.log_prob(action)
    # Three numbers with a quotient, a square, a product and a constant each; torch's order is another.
    squares = float((((action - mean) / log_std.exp()) ** 2).sum(1).max())
    np.testing.assert_allclose(log_prob.numpy(), expected.numpy(), rtol=0, atol=of_sum(3 * 5, squares + 5.0))
    np.testing.assert_allclose(entropy.item(), reference.entropy()[0].item(), rtol=0, atol=of_sum(3 * 3, 5.0))


def test_normalized_values_have_mean_zero_and_deviation_one() -> None:
    result = normalized(torch.tensor([1.0, 2.0, 3.0, 6.0]))
    assert result.mean().item() == pytest.approx(0.0, abs=of_sum(4 + 4, 2.0))
    assert result.std(unbiased=False).item() == pytest.approx(1.0, rel=of_sum(4 + 4) + 1e-8)
    assert normalized(torch.full((3,), 7.0)).tolist() == [0.0, 0.0, 0.0]
