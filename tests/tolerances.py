"""How far two computations of the same number may lie apart, by what rounding can do to them.

Two computations that do the same operations in the same order on the same machine agree to the last bit, and tests say
so with `==` or `assert_array_equal`. Everything else needs room: a library picks the order of a sum, and whether
products and sums are rounded once or twice, by the processor it runs on, by the number of rows, and by its version.
docs/reproducibility.md says which equality holds where.

Nothing here is fitted to what some machine gave. A tolerance follows from the number of roundings and the size of what
is rounded; where that leaves a choice, it is made on the wide side, and a mistake in the code has to stand out by more.
`pytest.approx` as it is, a millionth, serves numbers by hand: that is 17 roundings to 32 bits, and any number to 64.
"""

from __future__ import annotations

from collections.abc import Sequence

SINGLE = 2.0**-24
"""Largest relative error of one rounding to 32 bits."""
DOUBLE = 2.0**-53
"""Largest relative error of one rounding to 64 bits."""


def of_sum(terms: int, size: float = 1.0, unit: float = SINGLE) -> float:
    """Return how far two sums of the same `terms` products may lie apart.

    Each lies within `terms * unit` times the sum of the products' absolute values, `size`, of the true one, in whatever
    order it is added up, with or without fused multiply-add (Higham 2002, Accuracy and Stability of Numerical
    Algorithms, section 3.1). Usually the error is about the square root of that number of roundings.
    """
    return 2.0 * terms * unit * size


def of_network(widths: Sequence[int], largest: float = 1.0, unit: float = SINGLE) -> float:
    """Return how far two outputs of the same layers may lie apart; every layer sums over one of `widths` inputs.

    No layer's inputs exceed `largest`, and weights are as they start, within +-1/sqrt(width): the sums on the way stay
    below `largest`, too. Bias and activation are four more roundings: tanh is computed as 2 sigmoid(2x) - 1. An error
    passes on through the following layers as any input does, and does not grow there. Roundings have both signs and
    add up as such, and so do the two computations' errors; the largest of a million outputs is off by five or six times
    as much as usual.
    """
    roundings = sum(width + 4 for width in widths)
    return 6.0 * (2.0 * roundings) ** 0.5 * largest * unit


def of_log_prob(entries: int, away: float, std: float, error: float, unit: float = SINGLE) -> float:
    """Return how far two Gaussian log-probabilities of the same action of `entries` numbers may lie apart.

    Each number counts by half the square of its distance from the mean, at most `away` standard deviations: an error of
    the mean or of the action, `error`, counts so many times, in units of the smallest deviation, `std`. Beside that, a
    quotient, a square, a product, a logarithm of at most 4 and a constant are rounded for each number.
    """
    return entries * away * error / std + of_sum(5 * entries, entries * (away**2 + 5.0), unit)


ADAM_SLOPE = 5.0
"""Adam's step, learning rate * m / (sqrt(v) + epsilon), changes by at most this times learning rate / epsilon times a
change of the gradient: by one through m, as m is a mean of gradients, and by |m| / sqrt(v) through v, which is at most
(1 - 0.9) / sqrt(1 - 0.999) = 3.2 (Kingma and Ba 2015, section 2.1)."""


def of_adam_step(learning_rate: float, epsilon: float, gradient_error: float) -> float:
    """Return how far two of Adam's steps from the same moments may lie apart, with gradients `gradient_error` apart.

    The worst is a weight whose gradients were all tiny. Where they are below their own rounding errors, nothing is left
    but that no step is longer than 3.2 learning rates: in single precision, then, a few weights of thousands may differ
    by whole steps and nothing is wrong. In double precision the same code leaves them no such room.
    """
    return learning_rate * min(3.2 * 2.0, ADAM_SLOPE * gradient_error / epsilon)
