"""Go over a batch in minibatches, with several networks' updates side by side.

Shapes: `n` rows of a batch, `m` rows of a minibatch.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import torch

from codesign_bench.learning.ppo import Update, minibatches
from codesign_bench.task import Slots


class UpdateLoop:
    """Takes the gradient steps of a batch's updates."""

    def __init__(self) -> None:
        self._threads: ThreadPoolExecutor | None = None

    def use_cores(self, count: int) -> None:
        """Run updates in two threads if there are two cores; no number changes."""
        self._threads = None
        if count > 1:
            self._threads = ThreadPoolExecutor(2, initializer=torch.set_num_threads, initargs=(1,))

    def run(
        self, updates: Sequence[Update], rows: Slots, epochs: int, minibatch_size: int, rng: np.random.Generator
    ) -> None:
        """Let every update go over the same minibatches of `rows` (n,); the updates must share nothing."""
        parts = [rows[part] for _ in range(epochs) for part in minibatches(len(rows), minibatch_size, rng)]

        def learn(update: Update) -> None:
            for part in parts:
                self.step(update, part)

        if self._threads is None:
            for update in updates:
                learn(update)
        else:
            list(self._threads.map(learn, updates))

    def step(self, update: Update, rows: Slots) -> None:
        """Take one gradient step of `update` on `rows` (m,); a subclass may look on."""
        update.step(rows)
