"""Several updates go over the same minibatches, in turn or side by side. Shapes: `m` rows of a minibatch."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.learning.update_loop import UpdateLoop
from codesign_bench.task import Slots


class Listener:
    """An update that only remembers its rows."""

    def __init__(self) -> None:
        self.parts: list[list[int]] = []

    def step(self, rows: Slots) -> None:
        """Remember `rows` (m,)."""
        self.parts.append(rows.tolist())


@pytest.mark.parametrize("cores", [1, 2])
def test_all_updates_see_the_same_minibatches_in_the_same_order(cores: int) -> None:
    loop, updates = UpdateLoop(), (Listener(), Listener())
    loop.use_cores(cores)
    loop.run(updates, np.arange(10, 20), epochs=3, minibatch_size=5, rng=np.random.default_rng(0))
    first, second = (update.parts for update in updates)
    assert first == second
    assert len(first) == 3 * 2
    for epoch in range(3):
        assert sorted(first[2 * epoch] + first[2 * epoch + 1]) == list(range(10, 20))
    assert first[:2] != first[2:4], "each epoch has its own order"


def test_marked_rows_come_first_in_every_epoch() -> None:
    listener, rows = Listener(), np.arange(10, 20)
    UpdateLoop().run((listener,), rows, 2, 5, np.random.default_rng(0), first=rows >= 15)
    assert [sorted(part) for part in listener.parts] == 2 * [[15, 16, 17, 18, 19], [10, 11, 12, 13, 14]]


def test_an_error_in_a_thread_is_raised() -> None:
    class Failing(Listener):
        def step(self, rows: Slots) -> None:
            raise ArithmeticError

    loop = UpdateLoop()
    loop.use_cores(2)
    with pytest.raises(ArithmeticError):
        loop.run((Listener(), Failing()), np.arange(4), 1, 2, np.random.default_rng(0))
