"""What several rules share, by numbers that can be checked by hand."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import InsufficientData
from codesign_bench.claims.statistics import (
    at_each,
    check_methods,
    effect_scale,
    largest_of,
    run_command,
    seeds_at_each,
    seeds_of,
)
from codesign_bench.stats import Estimate
from evidence import OTHER, OURS, TASK, curves, finals


def budgets(ours: int, other: int) -> Evidence:
    """Return three seeds of two methods with these budgets."""
    flat = [(0.0, 1.0)] * 3
    parts = [curves(OURS, flat, steps=(0, ours)), curves(OTHER, flat, steps=(0, other))]
    return Evidence(pd.concat(parts), pd.concat([finals(OURS, (1.0,) * 3), finals(OTHER, (1.0,) * 3)]))


def test_returns_are_measured_by_the_largest_mean_of_a_method() -> None:
    parts = [finals(OURS, (1.0, 2.0, 3.0)), finals(OTHER, (-4.0, -4.0, -4.0)), finals("cma_es", (99.0,))]
    evidence = Evidence(evaluations=pd.concat([*parts, finals(OURS, (50.0,) * 3, task="scoop")]))
    assert effect_scale(evidence, TASK) == 4.0
    for nothing in (Evidence(), Evidence(evaluations=finals(OURS, (0.0,) * 3))):
        with pytest.raises(InsufficientData, match="no method has a return on push"):
            effect_scale(nothing, TASK)


def test_returns_are_measured_by_the_normalised_range_if_it_is_known() -> None:
    points = pd.DataFrame({"task": TASK, "point": ["idle", "best_known"], "return_mean": [-1.0, 9.0]})
    assert effect_scale(Evidence(references=points), TASK) == 10.0
    turned = points.assign(return_mean=[9.0, -1.0])
    with pytest.raises(InsufficientData, match="no method has a return"):
        effect_scale(Evidence(references=turned), TASK)


def test_several_are_below_a_threshold_if_each_of_them_is() -> None:
    steps = [Estimate(-2.0, -3.0, -1.0, 0.01), Estimate(-1.0, -1.8, -0.2, 0.04)]
    wider = [Estimate(-2.0, -3.5, -0.5, 0.01), Estimate(-1.0, -2.0, 0.1, 0.04)]
    assert largest_of(steps, wider, 0.0) == Estimate(-1.0, -2.0, -0.2, 0.04)


def test_one_of_several_above_a_threshold_is_found_in_as_many_tries() -> None:
    steps = [Estimate(-2.0, -3.0, -1.0, 0.001), Estimate(1.0, 0.2, 1.8, 0.02)]
    wider = [Estimate(-2.0, -3.5, -0.5, 0.001), Estimate(1.0, 0.1, 2.0, 0.02)]
    assert largest_of(steps, wider, 0.0) == Estimate(1.0, 0.1, 1.8, 0.04)


def test_a_step_without_spread_leaves_the_largest_without_an_interval() -> None:
    found = largest_of([Estimate(1.0), Estimate(0.5, 0.4, 0.6, 0.01)], [], 0.0)
    assert found.value == 1.0
    assert math.isnan(found.low)


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
    filled = command.format(results="runs", profile=" --profile quick", seeds={6: "6"})
    assert filled == "codesign-bench run --method all --task push --alpha 0.3 --seeds 6 --profile quick --out runs"
