"""The statistics equal what rliable says of the same scores; how these were made: tests/data/measure_rliable.py."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import trim_mean

from codesign_bench import stats

pytestmark = pytest.mark.numeric

RLIABLE = json.loads((Path(__file__).parents[1] / "data" / "rliable.json").read_text())
FIRST, SECOND = np.array(RLIABLE["first"]).T, np.array(RLIABLE["second"]).T
"""Scores of two methods, (tasks, runs)."""
DRAWN = 0.02
"""Most that an end of an interval may differ by the luck of the draw; scores and shares come in steps."""


def test_numbers_are_those_of_rliable() -> None:
    assert stats.mean(FIRST) == pytest.approx(RLIABLE["mean"])
    assert stats.interquartile_mean(FIRST) == pytest.approx(RLIABLE["interquartile_mean"])
    improvement = stats.probability_of_improvement(list(zip(FIRST, SECOND, strict=True)))
    assert improvement == pytest.approx(RLIABLE["probability_of_improvement"])
    profile = stats.performance_profile(list(FIRST), RLIABLE["thresholds"])
    assert profile.tolist() == pytest.approx(RLIABLE["performance_profile"])


def test_the_interval_of_an_interquartile_mean_across_tasks_is_that_of_rliable() -> None:
    rng = np.random.default_rng(0)
    across_tasks = stats.bootstrap(
        list(FIRST), lambda *runs: trim_mean(np.concatenate(runs, axis=1), 0.25, axis=1), rng, resamples=20_000
    )
    assert across_tasks == pytest.approx(RLIABLE["interquartile_mean_interval"], abs=DRAWN)
