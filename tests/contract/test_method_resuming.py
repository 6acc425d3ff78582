"""The check of resuming finds what a checkpoint loses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from codesign_bench.contract.method_resuming import resumes_to_the_bit
from codesign_bench.method import BatchReport, State
from contract_faults import FaultsOf
from sound import SoundSearch


def rounded(self: SoundSearch) -> State:
    """Lose digits."""
    state = SoundSearch.state(self)
    return State({"best": np.round(state.arrays["best"], 2)}, state.values)


def without_count(self: SoundSearch, state: State) -> None:
    """Forget how many steps were taken."""
    SoundSearch.load_state(self, state)
    self.env_steps = 0


def with_array(self: SoundSearch) -> State:
    """Put an array among the values."""
    state = SoundSearch.state(self)
    return State({}, {**state.values, "best": self.best})


def hidden(self: SoundSearch, remaining_steps: int) -> BatchReport:
    """Report what the state does not hold."""
    report = SoundSearch.train(self, remaining_steps)
    self.batches = getattr(self, "batches", 0) + 1
    return BatchReport(report.env_steps, {"batches": float(self.batches)}, 1)


@pytest.mark.parametrize(
    ("changes", "found"),
    [
        ({"state": rounded}, "the policy of the resumed method gives another design"),
        ({"load_state": without_count}, "after 2 more batches, other states: env_steps"),
        ({"state": with_array}, "`values` of the state has best, a ndarray"),
        ({"train": hidden}, "batch 0 after resuming reports something else"),
    ],
)
def test_what_a_checkpoint_loses_is_found(method_faults: FaultsOf, changes: dict[str, Any], found: str) -> None:
    assert found in method_faults(resumes_to_the_bit, **changes)
