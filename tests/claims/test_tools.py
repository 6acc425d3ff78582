"""Rules about tools and goals give each verdict where they should; numbers can be checked by hand."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
import pytest

from codesign_bench.claims import tools
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import CONTRADICTED, SUPPORTED, UNDECIDED, InsufficientData
from evidence import OURS, TASK, cells, found

VARY = tools.tools_vary(TASK, OURS, ())
WIDTHS: Mapping[str, Mapping[str, float]] = {TASK: {"design_length": 2.0, "design_angle": 4.0, "design_fixed": 0.0}}


def designs(lengths: Sequence[Sequence[float]]) -> Evidence:
    """Return evidence on seeds whose tools have these lengths, one per goal, and an angle twice the length."""
    flat = np.ravel(lengths)
    columns = {
        "seed": np.repeat(np.arange(len(lengths)), len(lengths[0])),
        "design_length": flat,
        "design_angle": 2.0 * flat,
        "design_fixed": np.full(len(flat), 0.005),
        "return": np.zeros(len(flat)),
    }
    return Evidence(evaluations=cells(OURS, **columns), design_widths=WIDTHS)


def test_tools_that_goals_alone_tell_apart_have_share_one() -> None:
    shares = tools.goal_shares(designs([(0.0, 1.0), (0.0, 1.0), (0.0, 1.0)]).evaluations, WIDTHS[TASK])
    assert shares.tolist() == [1.0, 1.0, 1.0]


def test_the_share_is_tested_against_a_tenth() -> None:
    # Each seed's two lengths lie 1, 1.1 and 1.2 from their mean, all around 2: variances 1, 1.21, 1.44, mean 3.65 / 3.
    finding = found(VARY, designs([(1.0, 3.0), (0.9, 3.1), (0.8, 3.2)]))
    shares = np.array([1.0, 1.21, 1.44]) / (3.65 / 3.0)
    assert (finding.verdict, finding.value, finding.n) == (SUPPORTED, pytest.approx(1.0), "3 seeds")
    half = 4.302653 * shares.std(ddof=1) / math.sqrt(3.0)
    assert (finding.low, finding.high) == (pytest.approx(1.0 - half, rel=1e-6), 1.0)
    # t = (1 - 0.1) / (sd / sqrt 3) with 2 degrees of freedom has the two-sided p 1 - t / sqrt(2 + t^2).
    t = 0.9 / (shares.std(ddof=1) / math.sqrt(3.0))
    assert finding.p == pytest.approx(1.0 - t / math.sqrt(2.0 + t**2))


def test_tools_that_differ_by_a_hair_are_one_tool() -> None:
    hair = 2.0 * 2.0 * 0.9 * tools.FLOOR / math.sqrt(2.0)  # of the length's range of 2; the angle varies as much
    rows = designs([(0.0, hair), (0.0, hair), (1.0, 1.0)]).evaluations
    assert tools.goal_shares(rows, WIDTHS[TASK]).tolist() == [0.0, 0.0, 0.0]
    assert tools.goal_shares(rows.assign(seed=0), WIDTHS[TASK]).tolist() == [1.0]


def test_one_tool_for_all_goals_has_share_zero_whatever_its_seeds_do() -> None:
    finding = found(VARY, designs([(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)]))
    assert (finding.verdict, finding.value) == (UNDECIDED, 0.0), "equal shares have no spread"
    almost = found(VARY, designs([(0.0, 0.1), (1.0, 1.0), (2.0, 2.0)]))
    assert almost.verdict == CONTRADICTED


def test_seeds_that_disagree_are_undecided() -> None:
    assert found(VARY, designs([(0.0, 0.0), (0.0, 2.0), (1.0, 1.0)])).verdict == UNDECIDED


def test_the_share_of_goals_by_hand() -> None:
    # Lengths 0, 2, 4, 6 have variance 5; each seed's own two have variance 1. Units of ranges cancel.
    rows = designs([(0.0, 2.0), (4.0, 6.0)]).evaluations
    assert tools.goal_shares(rows, WIDTHS[TASK]).tolist() == pytest.approx([0.2, 0.2])


def test_parameters_count_in_widths_of_their_ranges() -> None:
    # Length 0 or 2 between goals (a whole range, variance 1/4), angle 0 or 2 between seeds (half of it, 1/16).
    rows = designs([(0.0, 2.0), (0.0, 2.0)]).evaluations.assign(design_angle=[0.0, 0.0, 2.0, 2.0])
    assert tools.goal_shares(rows, WIDTHS[TASK]).tolist() == pytest.approx([0.25 / (0.25 + 0.0625)] * 2)


def test_a_task_that_is_not_known_is_lacking() -> None:
    with pytest.raises(InsufficientData, match="'push' is unknown, or cannot be used"):
        found(VARY, Evidence(evaluations=designs([(0.0,)] * 3).evaluations))


NO_SINGLE = tools.no_single_tool(TASK, ())


def tried(solves: Sequence[Sequence[int]], copies: int = 25) -> Evidence:
    """Return a design-sensitivity table in which each tool is there `copies` times."""
    rows = [
        {"task": TASK, "tool": tool, "goal": goal, "success": success}
        for tool, successes in enumerate(list(solves) * copies)
        for goal, success in enumerate(successes)
    ]
    return Evidence(sensitivity=pd.DataFrame(rows))


def test_no_single_tool_solves_all_that_can_be_solved() -> None:
    finding = found(NO_SINGLE, tried([(1, 1, 0, 0), (0, 1, 1, 0)]))
    assert (finding.verdict, finding.value) == (SUPPORTED, pytest.approx(2.0 / 3.0))
    assert finding.n == "50 tools, 3 of 4 goals"
    assert math.isnan(finding.low)


def test_a_tool_that_solves_all_that_can_be_solved_contradicts() -> None:
    finding = found(NO_SINGLE, tried([(1, 1, 0), (0, 1, 0)]))
    assert (finding.verdict, finding.value) == (CONTRADICTED, 1.0)


def test_few_tools_or_goals_say_nothing_of_tools_at_large() -> None:
    with pytest.raises(InsufficientData, match="4 tools and 2 goals"):
        found(NO_SINGLE, tried([(1, 0), (0, 1)], copies=2))
    with pytest.raises(InsufficientData, match="50 tools and 1 goals"):
        found(NO_SINGLE, tried([(1, 0), (0, 0)]))
    with pytest.raises(InsufficientData, match="not measured"):
        found(NO_SINGLE, Evidence())
