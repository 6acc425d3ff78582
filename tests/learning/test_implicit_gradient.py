"""The response term of a leader's gradient, on games whose answers are known. All in double precision.

Shapes: `P` parameters of the leader, `Q` parameters of the follower.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch
from torch import Tensor

from codesign_bench.learning.implicit_gradient import (
    conjugate_gradient,
    flat_gradient,
    hessian_product,
    response_term,
)

P, Q = 3, 4
EXACT = {"iterations": 50, "tolerance": 1e-14}


def matrix(seed: int, *shape: int) -> Tensor:
    """Return a random matrix."""
    return torch.from_numpy(np.random.default_rng(seed).normal(size=shape))


def definite(seed: int) -> Tensor:
    """Return a random symmetric positive definite matrix (Q, Q)."""
    root = matrix(seed, Q, Q)
    return root @ root.T + torch.eye(Q)


def finite_differences(function: Callable[[Tensor], Tensor], x: Tensor, step: float = 1e-5) -> Tensor:
    """Return the gradient (P,) of a function of `x` (P,) by central differences."""
    steps = step * torch.eye(len(x))
    return torch.stack([(function(x + one) - function(x - one)) / (2.0 * step) for one in steps])


def test_conjugate_gradients_solve_a_system_in_as_many_steps_as_it_has_unknowns() -> None:
    a, b = definite(0), matrix(1, Q)
    solved = conjugate_gradient(lambda v: a @ v, b, 50, 1e-10)
    np.testing.assert_allclose(solved.x, np.linalg.solve(a, b), rtol=1e-8)
    assert solved.iterations == Q


def test_they_end_at_the_tolerance_or_after_the_given_number_of_steps() -> None:
    a, b = definite(0), matrix(1, Q)
    for tolerance in (0.5, 0.1, 1e-2):
        solved = conjugate_gradient(lambda v: a @ v, b, 50, tolerance)
        assert torch.linalg.norm(a @ solved.x - b) <= tolerance * torch.linalg.norm(b)
        assert solved.iterations < 50
    assert conjugate_gradient(lambda v: a @ v, b, 2, 1e-12).iterations == 2


def test_their_first_step_is_the_longest_useful_one_along_the_target() -> None:
    # b'b / b'Ab = 5 / (2 * 1 + 3 * 4).
    solved = conjugate_gradient(lambda v: torch.tensor([2.0, 3.0]) * v, torch.tensor([1.0, 2.0]), 1, 1e-12)
    np.testing.assert_allclose(solved.x, np.array([1.0, 2.0]) * 5.0 / 14.0, rtol=1e-6)


def test_nothing_is_asked_for_a_target_of_zero() -> None:
    solved = conjugate_gradient(lambda v: pytest.fail("asked"), torch.zeros(Q), 50, 1e-3)
    assert not solved.x.any()
    assert solved.iterations == 0


def test_they_keep_what_they_have_where_the_matrix_is_not_positive() -> None:
    # The first direction has curvature 4 - 1 = 3; the second one is (1, 2) times a number, of curvature 1 - 4 < 0.
    solved = conjugate_gradient(
        lambda v: torch.tensor([1.0, -1.0], dtype=torch.float64) * v,
        torch.tensor([2.0, 1.0], dtype=torch.float64),
        50,
        1e-12,
    )
    np.testing.assert_allclose(solved.x, np.array([2.0, 1.0]) * 5.0 / 3.0)
    assert solved.iterations == 2


def test_products_with_a_hessian_without_the_hessian() -> None:
    x, y = matrix(2, 2, 2).requires_grad_(), matrix(3, 2).requires_grad_()
    loss = (x**3).sum() + (x @ y).exp().sum()
    vector = matrix(4, 6)
    found = hessian_product(loss, [x, y], damping=0.5)(vector)

    def of_flat(flat: Tensor) -> Tensor:
        first, second = flat[:4].view(2, 2), flat[4:]
        return (first**3).sum() + (first @ second).exp().sum()

    whole = torch.autograd.functional.hessian(of_flat, torch.cat([x.detach().flatten(), y.detach()]))
    np.testing.assert_allclose(found.detach(), whole @ vector + 0.5 * vector, rtol=1e-12)


def test_a_gradient_is_zero_where_nothing_depends_on_a_parameter() -> None:
    used, unused = torch.tensor([1.0, 2.0], requires_grad=True), torch.tensor([3.0], requires_grad=True)
    assert flat_gradient((used**2).sum(), [used, unused]).tolist() == [2.0, 4.0, 0.0]


def test_the_response_by_hand() -> None:
    # f = 3 y, g = 4 x y, F = 1, damping 1: s = 3 / 2, and the response term is 4 * 3 / 2. Indeed the follower moves
    # by -4 x / 2, and so f changes by -6 x.
    x, y = torch.tensor([0.7], requires_grad=True), torch.tensor([0.2], requires_grad=True)
    response = response_term((4.0 * x * y).sum(), torch.tensor([3.0]), lambda v: 2.0 * v, [x], [y], **EXACT)
    assert response.gradient.tolist() == pytest.approx([6.0])
    assert response.iterations == 1


def test_the_leader_anticipates_one_damped_step_of_the_follower() -> None:
    """f is linear and g bilinear in y, so that the first order is all there is."""
    cross, slope, fisher, damping = matrix(5, P, Q), matrix(6, Q), definite(7), 0.3
    x, y = matrix(8, P), matrix(9, Q)

    def leader_loss(x: Tensor, y: Tensor) -> Tensor:
        return (x**2).sum() + slope @ y

    def after_the_step(x: Tensor) -> Tensor:
        push = torch.sin(x) @ cross  # grad_y of g = sin(x) B y
        return leader_loss(x, y - torch.linalg.solve(fisher + damping * torch.eye(Q), push))

    lead, follow = x.clone().requires_grad_(), y.clone().requires_grad_()
    direct = flat_gradient(leader_loss(lead, follow), [lead])
    response = response_term(
        torch.sin(lead) @ cross @ follow, slope, lambda v: fisher @ v + damping * v, [lead], [follow], **EXACT
    )
    np.testing.assert_allclose(direct - response.gradient, finite_differences(after_the_step, x), rtol=1e-7)


def test_with_the_hessian_of_the_followers_loss_it_is_the_implicit_function_theorem() -> None:
    """g is quadratic in y, so that the best response is known: f(x, y*(x)) has this very gradient."""
    curvature, cross, weight, offset = definite(10), matrix(11, P, Q), definite(12), matrix(13, Q)

    def follower_loss(x: Tensor, y: Tensor) -> Tensor:
        return 0.5 * y @ curvature @ y + torch.tanh(x) @ cross @ y

    def best(x: Tensor) -> Tensor:
        return -torch.linalg.solve(curvature, torch.tanh(x) @ cross)

    def leader_loss(x: Tensor, y: Tensor) -> Tensor:
        return 0.5 * (y - offset) @ weight @ (y - offset) + (x**2).sum() * y.sum()

    x = matrix(14, P)
    lead, follow = x.clone().requires_grad_(), best(x).requires_grad_()
    loss = leader_loss(lead, follow)
    direct, slope = (flat_gradient(loss, [one], retain_graph=True) for one in (lead, follow))
    product = hessian_product(follower_loss(lead, follow), [follow])
    response = response_term(follower_loss(lead, follow), slope, product, [lead], [follow], **EXACT)
    expected = finite_differences(lambda x: leader_loss(x, best(x)), x)
    np.testing.assert_allclose(direct - response.gradient, expected, rtol=1e-6)
    assert torch.linalg.norm(response.gradient) > 0.1 * torch.linalg.norm(direct)
