"""Run settings that mean nothing are refused before anything runs."""

from __future__ import annotations

import pytest

from codesign_bench.config.run_settings import RunSettings


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"steps": 0}, "steps must be at least 1, not 0"),
        ({"evaluations": 0}, "evaluations must be at least 1, not 0"),
        ({"fine_tuning_steps": -1}, "fine_tuning_steps must be at least 1, not -1"),
        ({"threads": 0}, "threads must be at least 1, not 0"),
        ({"tradeoff_scale": -0.5}, "tradeoff_scale must not be negative: -0.5"),
        ({"instances": "training"}, "instances must be evaluation or validation, not 'training'"),
        ({"device": "abacus"}, "device must be one of cpu, cuda, not 'abacus'"),
    ],
)
def test_a_value_out_of_range_is_named(change: dict, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        RunSettings(**change)


def test_values_at_the_limits_are_allowed() -> None:
    settings = RunSettings(steps=1, evaluations=1, fine_tuning_steps=1, threads=1, tradeoff_scale=0.0, device="cuda")
    assert settings.steps == 1
