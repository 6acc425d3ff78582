"""Iterate over a batch in minibatches, with the updates of several networks in parallel.

Shapes: `n` rows of a batch, `m` rows of a minibatch.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import torch

from codesign_bench.learning.ppo import Update, minibatches
from codesign_bench.task import Booleans, Slots


class UpdateLoop:
    """Takes the gradient steps of a batch."""

    def __init__(self) -> None:
        self._threads: ThreadPoolExecutor | None = None

    def use_cores(self, count: int) -> None:
        """Run updates in two threads if there are at least two cores; results do not change."""
        self._threads = None
        if count > 1:
            self._threads = ThreadPoolExecutor(2, initializer=torch.set_num_threads, initargs=(1,))

    def run(
        self,
        updates: Sequence[Update],
        rows: Slots,
        epochs: int,
        minibatch_size: int,
        rng: np.random.Generator,
        first: Booleans | None = None,
    ) -> None:
        """Run every update on the same minibatches of `rows` (n,); the updates must not share parameters.

        The rows that `first` (n,) marks come first in every epoch.
        """
        # All minibatches are drawn before any update runs: the order of threads, or a policy that stops early, then has
        # no effect on the random numbers of the other updates and of later batches.
        parts = [part for epoch in drawn(rows, epochs, minibatch_size, rng, first) for part in epoch]

        def learn(update: Update) -> None:
            for part in parts:
                self.step(update, part)

        if self._threads is None:
            for update in updates:
                learn(update)
        else:
            list(self._threads.map(learn, updates))

    def step(self, update: Update, rows: Slots) -> None:
        """Take one gradient step of `update` on `rows` (m,); a subclass may observe it."""
        update.step(rows)


def drawn(
    rows: Slots, epochs: int, minibatch_size: int, rng: np.random.Generator, first: Booleans | None = None
) -> list[list[Slots]]:
    """Return the minibatches of `rows` (n,) of every epoch; the rows that `first` (n,) marks come first."""
    return [[rows[part] for part in minibatches(len(rows), minibatch_size, rng, first)] for _ in range(epochs)]
