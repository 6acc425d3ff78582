"""Run settings that mean nothing are refused before anything runs."""

from __future__ import annotations

import pytest

from codesign_bench.config.run_settings import RunSettings


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"steps": 0}, "steps must be an integer from 1 to 1,000,000,000,000, not 0"),
        ({"evaluations": 0}, "evaluations must be an integer from 1 to 100,000, not 0"),
        ({"fine_tuning_steps": -1}, "fine_tuning_steps must be an integer from 1 to 1,000,000,000,000, not -1"),
        ({"threads": 0}, "threads must be an integer from 1 to 4,096, not 0"),
        ({"tradeoff_scale": -0.5}, "tradeoff_scale must be a number from 0 to 1e[+]06, not -0.5"),
        ({"instances": "training"}, "instances must be one of evaluation, validation, not 'training'"),
        ({"tradeoff_scale": float("nan")}, "tradeoff_scale must be a number from 0 to 1e[+]06, not nan"),
        ({"steps": float("inf")}, "steps must be an integer"),
        ({"device": "abacus"}, "device must be one of cpu, cuda, not 'abacus'"),
    ],
)
def test_a_value_out_of_range_is_named(change: dict, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        RunSettings(**change)


def test_values_at_the_limits_are_allowed() -> None:
    settings = RunSettings(steps=1, evaluations=1, fine_tuning_steps=1, threads=1, tradeoff_scale=0.0, device="cuda")
    assert settings.steps == 1
