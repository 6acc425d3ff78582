"""All checks of a method: a sound method passes every one."""

from __future__ import annotations

from codesign_bench import registry
from codesign_bench.contract import METHOD_CHECKS, examine_method
from codesign_bench.contract.methods import LOADS
from sound import SoundReach, SoundSearch


def test_a_sound_method_passes_every_check_and_none_is_left_out(toy: None) -> None:
    registry.register("methods", SoundSearch.name, lambda: SoundSearch)
    verdicts = list(examine_method(SoundSearch.name, SoundReach()))
    assert [verdict.check for verdict in verdicts] == [LOADS, *METHOD_CHECKS]
    assert [(verdict.faults, verdict.left_out) for verdict in verdicts] == [((), "")] * len(verdicts)
