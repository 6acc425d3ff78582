"""The rise over the last third of a curve, by curves whose rise can be read off."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from codesign_bench.stats import late_gains


def curve(values: list[float], method: str = "gnn_ppo", seed: int = 0) -> pd.DataFrame:
    """Return an evaluation at every hundred steps."""
    steps = 100 * np.arange(len(values))
    keys = {"task": "push", "method": method, "variant": "default", "seed": seed}
    return pd.DataFrame({**keys, "env_steps": steps, "return_mean": values})


def gain(frame: pd.DataFrame) -> float:
    (found,) = late_gains(frame, "return_mean")["late_gain"]
    return float(found)


def test_a_straight_curve_gains_a_third_of_its_rise() -> None:
    assert gain(curve([float(step) for step in range(10)])) == pytest.approx(3.0)


def test_what_happens_before_the_last_third_does_not_matter() -> None:
    assert gain(curve([-50.0, 0.0, 7.0, 9.0, 9.0, 9.0, 5.0, 5.0, 5.0, 5.0])) == pytest.approx(0.0)
    assert gain(curve([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 8.0, 6.0, 4.0, 2.0])) == pytest.approx(-6.0)


def test_one_lucky_evaluation_counts_less_than_its_height() -> None:
    # The line through (0, 0), (1, 0), (2, 0), (3, 1) has a slope of 0.3, so it rises by 0.9 over three intervals.
    assert gain(curve([0.0] * 9 + [1.0])) == pytest.approx(0.9)


def test_the_mean_over_seeds_counts_of_each_method_by_itself() -> None:
    rising, falling = [float(step) for step in range(10)], [-float(step) for step in range(10)]
    frame = pd.concat([curve(rising), curve(falling, seed=1), curve(rising, "cma_es")])
    found = late_gains(frame, "return_mean").set_index("method")["late_gain"]
    assert found["gnn_ppo"] == pytest.approx(0.0)
    assert found["cma_es"] == pytest.approx(3.0)


def test_a_curve_with_few_evaluations_has_no_estimate() -> None:
    assert np.isnan(gain(curve([0.0, 1.0, 2.0])))
