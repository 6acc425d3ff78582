"""Every task's physics holds what its `soundness` promises, for long: nothing runs away, escapes or leaks.

The contract plays a few thousand steps of every task ([test_contract.py](test_contract.py)); here they are a million.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from codesign_bench.contract import DoesWithoutError, Fault
from codesign_bench.contract.task_physics import SLOTS, broken_limits, changed_outcomes, random_controls, random_designs
from codesign_bench.task import Task, load_task, task_names
from codesign_bench.task.episodes import Episodes

pytestmark = pytest.mark.numeric


@pytest.fixture(params=task_names())
def task(request: pytest.FixtureRequest) -> Task:
    """Every task, one after the other."""
    return load_task(request.param)


@pytest.mark.slow
def test_nothing_overlaps_runs_away_or_escapes_in_a_million_steps(task: Task) -> None:
    assert found(lambda: broken_limits(task, 1_000_000)) == []


@pytest.mark.slow
def test_half_the_physics_step_leaves_the_outcomes_of_many_episodes_alike(task: Task) -> None:
    assert found(lambda: changed_outcomes(task, 96)) == []


def found(search: Callable[[], Iterator[Fault]]) -> list[Fault]:
    """Return what is found; skip where the task promises nothing."""
    try:
        return list(search())
    except DoesWithoutError as reason:
        pytest.skip(str(reason))


@pytest.mark.slow
def test_memory_stays_flat_over_twenty_thousand_tools(task: Task) -> None:
    rng, slots = np.random.default_rng(3), np.arange(SLOTS)
    episodes = Episodes(task, SLOTS)

    def rebuild(count: int) -> None:
        for _ in range(count // SLOTS):
            episodes.begin(slots, task.sample_instances(rng, SLOTS))
            episodes.design(slots, random_designs(rng, task, SLOTS))
            episodes.control(slots, random_controls(rng, task, SLOTS))

    rebuild(2_000)
    before = resident_megabytes()
    rebuild(20_000)
    assert resident_megabytes() - before < 10.0


def resident_megabytes() -> float:
    """Return the memory that this process holds."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20
