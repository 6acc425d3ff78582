"""What tests of the contract share: a changed member is asked for one promise, and the faults are returned as text."""

from __future__ import annotations

from collections.abc import Callable

from codesign_bench.contract import Verdict

FaultsOf = Callable[..., str]


def text_of(verdict: Verdict) -> str:
    """Return the faults that were found, a line each, or why nothing was asked; empty: nothing is wrong."""
    assert all(fault.found and fault.expected for fault in verdict.faults)
    return "\n".join(fault.found for fault in verdict.faults) or verdict.left_out
