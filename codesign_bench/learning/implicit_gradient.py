"""The gradient of a leader's loss through the response of a follower, without the follower's Hessian.

Shapes: `P` parameters of the leader, `Q` parameters of the follower.

A leader chooses x (P,) and a follower y (Q,). The follower answers x by a damped natural step on its own loss g:

    y'(x) = y - (F + damping I)^-1 grad_y g(x, y),

where F is the curvature of the distance between policies, the Fisher information, taken as constant. To first order in
that step, the leader's loss after it, f(x, y'(x)), has the gradient

    grad_x f  -  grad_x < grad_y g(x, y), s >,   where (F + damping I) s = grad_y f.

The first term takes the follower as fixed; the second is the response term, computed here. With the Hessian of g in
place of F + damping I, at a y that minimises g, this is the implicit function theorem, and exact.
Source: Stackelberg PPO (Dai, Wang, Ashley, Schmidhuber; ICLR 2026, 2603.15388) and its code.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

Product = Callable[[Tensor], Tensor]
"""Maps a vector (Q,) to a symmetric matrix times that vector, (Q,)."""


@dataclass(frozen=True)
class Solution:
    """An approximate solution of a linear system."""

    x: Tensor
    """(Q,)"""
    iterations: int
    """Products with the matrix that it took."""


def conjugate_gradient(product: Product, target: Tensor, iterations: int, tolerance: float) -> Solution:
    """Solve A x = `target` (Q,) for the symmetric positive definite A of `product` (Hestenes and Stiefel 1952).

    Args:
        product: multiplies with A.
        target: right-hand side (Q,).
        iterations: most products with A.
        tolerance: norm of the residual, as a fraction of that of `target`, at which the solution is good enough.
    """
    x, residual, direction = torch.zeros_like(target), target, target
    squared = residual @ residual
    enough = tolerance**2 * squared
    for taken in range(iterations):
        if squared <= enough:  # also where the target is zero, and so is the solution
            return Solution(x, taken)
        image = product(direction)
        curvature = direction @ image
        # Only rounding makes a damped Fisher matrix indefinite. What has been found so far is the best that it allows.
        if curvature <= 0.0:
            return Solution(x, taken + 1)
        length = squared / curvature
        x, residual = x + length * direction, residual - length * image
        before, squared = squared, residual @ residual
        direction = residual + (squared / before) * direction
    return Solution(x, iterations)


def hessian_product(loss: Tensor, parameters: Sequence[Tensor], damping: float = 0.0) -> Product:
    """Return the products of vectors (Q,) with the Hessian of `loss` () at `parameters`, plus `damping` times them.

    If the loss is the divergence between a policy and a constant copy of it, this is the Fisher information.
    """
    slope = flat_gradient(loss, parameters, create_graph=True)

    def product(vector: Tensor) -> Tensor:
        return flat_gradient(slope @ vector, parameters, retain_graph=True) + damping * vector

    return product


@dataclass(frozen=True)
class Response:
    """The response term of a leader's gradient."""

    gradient: Tensor
    """(P,) to be subtracted from the gradient that treats the follower as fixed."""
    iterations: int
    """Products with the damped curvature that it took."""


def response_term(
    follower_loss: Tensor,
    leader_slope: Tensor,
    curvature: Product,
    leader: Sequence[Tensor],
    follower: Sequence[Tensor],
    iterations: int,
    tolerance: float,
) -> Response:
    """Return grad_x < grad_y g, s > (P,), where `curvature` of s equals `leader_slope`.

    Args:
        follower_loss: g (), differentiable in the parameters of both.
        leader_slope: grad_y f (Q,), the gradient of the leader's loss in the follower's parameters.
        curvature: multiplies with F + damping I.
        leader: the parameters x.
        follower: the parameters y.
        iterations: most steps of conjugate gradients.
        tolerance: relative residual at which they end.
    """
    solved = conjugate_gradient(curvature, leader_slope, iterations, tolerance)
    slope = flat_gradient(follower_loss, follower, create_graph=True)
    return Response(flat_gradient(slope @ solved.x, leader), solved.iterations)


def flat_gradient(
    value: Tensor, parameters: Sequence[Tensor], create_graph: bool = False, retain_graph: bool | None = None
) -> Tensor:
    """Return the gradient of `value` () in all `parameters`, one after the other; zero where it depends on none."""
    gradients = torch.autograd.grad(
        value, parameters, retain_graph=retain_graph, create_graph=create_graph, materialize_grads=True
    )
    return torch.cat([gradient.reshape(-1) for gradient in gradients])
