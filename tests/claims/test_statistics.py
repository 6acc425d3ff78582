"""What several rules share, by numbers that can be checked by hand."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import InsufficientData
from codesign_bench.claims.statistics import (
    at_each,
    check_methods,
    difference,
    estimate,
    mean,
    run_command,
    seeds_at_each,
    seeds_of,
    trend,
)
from evidence import OTHER, OURS, TASK, curves, finals


def resampled(*samples: list[float]) -> list[np.ndarray]:
    """Return samples as one resample each, (1, N)."""
    return [np.array([sample]) for sample in samples]


def budgets(ours: int, other: int) -> Evidence:
    """Return three seeds of two methods with these budgets."""
    flat = [(0.0, 1.0)] * 3
    parts = [curves(OURS, flat, steps=(0, ours)), curves(OTHER, flat, steps=(0, other))]
    return Evidence(pd.concat(parts), pd.concat([finals(OURS, (1.0,) * 3), finals(OTHER, (1.0,) * 3)]))


def test_means_and_differences_are_per_resample() -> None:
    sample = np.array([[1.0, 3.0], [5.0, 7.0]])
    assert mean(sample).tolist() == [2.0, 6.0]
    assert difference(sample, np.array([[1.0, 1.0], [9.0, 9.0]])).tolist() == [1.0, -3.0]


def test_an_estimate_is_the_statistic_of_the_samples_themselves_within_its_interval() -> None:
    samples = [np.array([1.0, 2.0, 6.0]), np.array([0.0, 1.0, 2.0])]
    value, low, high = estimate(samples, difference, np.random.default_rng(0))
    assert value == pytest.approx(3.0 - 1.0)
    assert low < value < high
    assert low >= 1.0 - 2.0  # all resamples of the lowest less all of the highest
    assert high <= 6.0 - 0.0


def test_a_trend_is_the_rank_correlation_of_levels_and_means() -> None:
    levels = (0.1, 0.2, 0.9)
    assert trend(levels)(*resampled([1.0, 3.0], [5.0], [9.0])).tolist() == [pytest.approx(1.0)]
    assert trend(levels)(*resampled([9.0], [5.0], [1.0])).tolist() == [pytest.approx(-1.0)]
    # Ranks 1, 3, 2 against 1, 2, 3: 1 - 6 (0 + 1 + 1) / (3 * 8).
    assert trend(levels)(*resampled([1.0], [9.0], [5.0])).tolist() == [pytest.approx(0.5)]
    assert trend(levels)(*resampled([2.0], [2.0], [2.0])).tolist() == [0.0]


def test_a_trend_is_looked_for_in_every_resample() -> None:
    samples = [np.array([[0.0], [9.0]]), np.array([[1.0], [1.0]]), np.array([[2.0], [0.0]])]
    assert trend((1.0, 2.0, 3.0))(*samples) == pytest.approx([1.0, -1.0])


def test_levels_are_read_in_rising_order_and_those_without_data_left_out() -> None:
    def read(level: float) -> np.ndarray:
        if level == 0.3:
            raise InsufficientData("nothing at 0.3")
        return np.full(3, level)

    found = at_each((0.9, 0.1, 0.3, 0.5), read)
    assert list(found) == [0.1, 0.5, 0.9]
    assert found[0.5].tolist() == [0.5, 0.5, 0.5]
    with pytest.raises(InsufficientData, match=r"nothing at 0\.3"):
        at_each((0.1, 0.3, 0.5), read)


def test_budgets_may_differ_by_a_tenth() -> None:
    check_methods(budgets(1_000, 1_100), TASK, OURS, OTHER)
    with pytest.raises(InsufficientData, match="budgets differ on push: 1,000 and 1,101 environment steps"):
        check_methods(budgets(1_000, 1_101), TASK, OURS, OTHER)
    with pytest.raises(InsufficientData, match="0 finished seeds"):
        check_methods(budgets(1_000, 1_000), TASK, OURS, "cma_es")


def test_seeds_are_counted_in_words() -> None:
    three, six = np.zeros(3), np.zeros(6)
    assert seeds_of(three, six) == "3 and 6 seeds"
    assert seeds_at_each({0.4: three, 0.6: six, 1.0: six}) == "3-6 seeds at each of 0.4, 0.6, 1"
    assert seeds_at_each({0.4: three, 0.6: three}) == "3 seeds at each of 0.4, 0.6"


def test_commands_leave_the_places_that_are_filled_in_later() -> None:
    command = run_command("all", "push", 6, " --alpha 0.3")
    told = command.format(results="runs", profile=" --profile quick")
    assert told == "codesign-bench run --method all --task push --alpha 0.3 --seeds 6 --profile quick --out runs"
