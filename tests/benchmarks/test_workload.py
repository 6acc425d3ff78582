"""Speeds are put together as they should be, by hand."""

from __future__ import annotations

import pytest

from codesign_bench.benchmarks.workload import Speed, together


def test_end_to_end_by_hand() -> None:
    # A step costs 1 ms to roll out and twice 0.25 ms to learn from.
    assert Speed(rollout=1_000.0, update=4_000.0, peak_megabytes=1.0).end_to_end(epochs=2) == pytest.approx(1e3 / 1.5)


def test_cells_side_by_side_by_hand() -> None:
    both = together([Speed(1_000.0, 4_000.0, 300.0, gigaflops=5.0), Speed(3_000.0, 2_000.0, 200.0, gigaflops=6.0)])
    assert both == Speed(4_000.0, 6_000.0, 300.0, gigaflops=11.0)
    assert together([Speed(1.0, 1.0, 1.0)]).gigaflops is None
