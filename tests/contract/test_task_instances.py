"""Each check of a task's instances finds the fault that it is there for."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from typing import Any

import numpy as np
import pytest

from codesign_bench.contract import Check
from codesign_bench.contract import task_instances as checks
from codesign_bench.task import Floats, Task
from contract_faults import FaultsOf

calls = count()


def drawn(draw: Callable[[np.random.Generator, int], Floats]) -> dict[str, Any]:
    """Return a change of the way in which instances are drawn."""
    return {"sample_instances": lambda self, rng, count: draw(rng, count)}


@pytest.mark.parametrize(
    ("check", "changes", "found"),
    [
        (
            checks.evaluation_instances_are_fixed,
            drawn(lambda rng, count: np.random.default_rng(next(calls)).uniform(size=(count, 1))),
            "a second call gave other instances",
        ),
        (checks.evaluation_instances_are_fixed, drawn(lambda rng, count: np.full((count, 1), 0.5)), "1 different"),
        (checks.evaluation_instances_are_fixed, drawn(lambda rng, count: rng.uniform(size=(count, 2))), "shape (8, 2)"),
        (checks.evaluation_instances_are_fixed, drawn(lambda rng, count: 2 + rng.random((count, 1))), "has goal = 2."),
        (
            checks.validation_instances_are_others,
            {"validation_instances": Task.evaluation_instances},
            "8 instances",
        ),
        (checks.validation_instances_are_others, {"validation_instances": lambda self: np.zeros((1, 1))}, "(1, 1)"),
        (
            checks.instances_follow_their_generator,
            drawn(lambda rng, count: np.random.default_rng(next(calls)).uniform(size=(count, 1))),
            "the same seed gave other instances",
        ),
        (checks.instances_follow_their_generator, drawn(lambda rng, count: np.zeros((count, 1))), "another seed"),
        (checks.positions_have_a_region, {"position_entries": ("place",)}, "position_entries names ['place']"),
        (checks.positions_have_a_region, {"position_entries": ()}, "it has `in_cutout`, but no `position_entries`"),
        (checks.positions_have_a_region, {"in_region": lambda self, i: i[:, 0] < 0.5}, "outside of `in_region`"),
        (checks.positions_have_a_region, {"in_cutout": lambda self, i, f: i[:, 0] < 0.5}, "cutout of fraction 0"),
        (checks.region_ends_with_the_instances, {"in_region": lambda self, i: i[:, 0] < 2.0}, "goal = 1 is in"),
        (checks.region_ends_with_the_instances, {"position_entries": ()}, "no goal or start is a position"),
        (
            checks.training_leaves_the_cutout_out,
            {"in_cutout": lambda self, i, f: np.random.default_rng(next(calls)).random(len(i)) < f},
            "a second call puts other instances in the cutout",
        ),
        (checks.training_leaves_the_cutout_out, {"in_cutout": lambda self, i, f: i[:, 0] < 2.0}, "every instance"),
        (
            checks.cutout_is_the_stated_share,
            {"in_cutout": lambda self, i, f: i[:, 0] < 0.5 * f},
            "0.2 holds 0.1",
        ),
        (
            checks.cutout_is_the_stated_share,
            {"in_cutout": lambda self, i, f: (i[:, 0] + 3.0 * f) % 1.0 < f},
            "a cutout of 0.3 leaves out some of one of 0.2",
        ),
        (
            checks.fine_tuning_is_outside_the_region,
            {"fine_tuning_instances": lambda s: np.ones((1, 2, 1))},
            "(1, 2, 1)",
        ),
        (
            checks.fine_tuning_is_outside_the_region,
            {"fine_tuning_instances": lambda s: np.ones((1, 8, 1))},
            "8 instances",
        ),
    ],
)
def test_what_is_wrong_is_found(task_faults: FaultsOf, check: Check[Task], changes: dict[str, Any], found: str) -> None:
    assert found in task_faults(check, **changes)


def test_a_changed_distribution_outside_of_the_cutout_is_found(task_faults: FaultsOf) -> None:
    def sample(self: Task, rng: np.random.Generator, count: int) -> Floats:
        """Draw higher goals when only a few are asked for, as when those in the cutout are drawn again."""
        return rng.uniform(size=(count, 1)) ** (1.0 if count == checks.SAMPLES else 0.3)

    found = task_faults(checks.training_leaves_the_cutout_out, sample_instances=sample)
    assert "goal has another distribution" in found
