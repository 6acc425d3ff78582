"""Each check of how a method trains finds the fault that it is there for."""

from __future__ import annotations

import random
from collections.abc import Callable
from itertools import count
from typing import Any

import numpy as np
import pytest
import torch

from codesign_bench.contract import Check, Subject
from codesign_bench.contract import method_training as checks
from codesign_bench.method import BatchReport, Policy
from contract_faults import FaultsOf
from sound import SoundSearch
from toy import ConstantPolicy

calls = count()
Train = Callable[[SoundSearch, int], BatchReport]


def after(change: Callable[[SoundSearch, BatchReport], Any]) -> dict[str, Any]:
    """Return training after which `change` does something, or reports something else."""

    def train(self: SoundSearch, remaining_steps: int) -> BatchReport:
        report = SoundSearch.train(self, remaining_steps)
        changed = change(self, report)
        return changed if isinstance(changed, BatchReport) else report

    return {"train": train}


def fixed(self: SoundSearch) -> Policy:
    """Return a policy that never changes."""
    return ConstantPolicy(np.zeros(2))


def long(self: SoundSearch, remaining_steps: int) -> BatchReport:
    """Ignore what is left."""
    return SoundSearch.train(self, 1_000)


def worse(self: SoundSearch, report: BatchReport) -> None:
    """Move by what no stream gives."""
    self.best = self.best + 0.01 * next(calls)


def unseeded(self: SoundSearch, report: BatchReport) -> None:
    """Move to the same place whatever the seed."""
    self.best = np.full(2, 0.1)


@pytest.mark.parametrize(
    ("check", "changes", "found"),
    [
        (checks.training_changes_the_policy, {"policy": fixed}, "20 batches left every array"),
        (checks.training_changes_the_policy, after(lambda m, r: BatchReport(r.env_steps, {})), "`metrics` of a batch"),
        (
            checks.training_changes_the_policy,
            after(lambda m, r: BatchReport(r.env_steps, {"loss": float("nan")})),
            "not finite: loss",
        ),
        (
            checks.every_step_counts,
            after(lambda m, r: BatchReport(r.env_steps - 4, r.metrics)),
            "batch 0 reports 19 environment steps, and 23 were simulated",
        ),
        (checks.last_batch_is_small, {"train": long}, "with one step left, a batch took"),
        (checks.seed_decides, after(worse), "the same seed gives another state: best"),
        (checks.seed_decides, after(unseeded), "another seed gives the same policy"),
        (checks.global_generators_are_left_alone, after(lambda m, r: np.random.seed(0)), "generator of numpy"),  # noqa: NPY002
        (checks.global_generators_are_left_alone, after(lambda m, r: torch.rand(1)), "generator of torch"),
        (checks.global_generators_are_left_alone, after(lambda m, r: random.random()), "generator of random"),
    ],
)
def test_what_is_wrong_is_found(
    method_faults: FaultsOf, check: Check[Subject], changes: dict[str, Any], found: str
) -> None:
    assert found in method_faults(check, **changes)
