"""Rules about deployed tools give each verdict where they should."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
import pytest

from codesign_bench.claims import deployment
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import CONTRADICTED, SUPPORTED, UNDECIDED, InsufficientData
from evidence import found

OWN = deployment.arm_keeps_what_training_solves("fetch_cube", "gnn_ppo", tools=4, trials=5)
GRID = deployment.no_tool_solves_the_grid("fetch_cube", "gnn_ppo", tools=4, starts=12)


def own(*solved: int, trials: int = 5, seeds: int = 5, in_training: Sequence[int] = (1, 1, 1, 1)) -> Evidence:
    """Return trials on own instances: tool t of every policy succeeds in the first `solved[t]` of them."""
    rows = [
        {
            **{"task": "fetch_cube", "kind": "own", "policy_seed": seed, "tool": tool, "row": -1, "column": -1},
            "success": int(number < wins),
            "solved_in_training": in_training[tool - 1],
        }
        for seed in range(seeds)
        for tool, wins in enumerate(solved, start=1)
        for number in range(trials)
    ]
    return Evidence(deployment=pd.DataFrame(rows))


def grid(*solved: Sequence[int]) -> Evidence:
    """Return trials on the grid: tool t solves the starts numbered `solved[t]` of twelve."""
    where = {"task": "fetch_cube", "kind": "grid", "policy_seed": 0}
    rows = [
        {**where, "tool": tool, "row": row, "column": column, "success": int(number in won)}
        for tool, won in enumerate(solved, start=1)
        for number, (row, column) in enumerate(np.ndindex(3, 4))
    ]
    return Evidence(deployment=pd.DataFrame(rows))


def test_the_arm_keeps_what_training_solves() -> None:
    finding = found(OWN, own(5, 4, 3, 3))
    assert (finding.verdict, finding.value) == (SUPPORTED, 1.0)
    assert finding.n == "20 of 20 tools solved in training, 5 seeds"
    # The exact interval of 20 of 20, and p = 2 / 2^20.
    assert (finding.low, finding.p) == (pytest.approx(0.025 ** (1 / 20)), pytest.approx(2 / 2**20))
    assert found(OWN, own(0, 1, 2, 2)).verdict == CONTRADICTED
    assert found(OWN, own(5, 5, 2, 2)).verdict == UNDECIDED


def test_what_fails_in_training_as_well_says_nothing_of_the_arm() -> None:
    finding = found(OWN, own(5, 5, 0, 0, in_training=(1, 1, 0, 0)))
    assert (finding.verdict, finding.value) == (SUPPORTED, 1.0)
    assert finding.n == "10 of 20 tools solved in training, 5 seeds"
    assert finding.note == "successes by tool: 25/25, 25/25"
    with pytest.raises(InsufficientData, match="no deployed policy solves its own instances"):
        found(OWN, own(5, 5, 5, 5, in_training=(0, 0, 0, 0)))


def test_too_few_seeds_tools_or_trials_say_nothing() -> None:
    with pytest.raises(InsufficientData, match="policies of 4 seeds of fetch_cube were deployed; 5 are needed"):
        found(OWN, own(5, 5, 5, 5, seeds=4))
    with pytest.raises(InsufficientData, match="3 tools of fetch_cube"):
        found(OWN, own(5, 5, 5))
    with pytest.raises(InsufficientData, match="4 trials of a tool"):
        found(OWN, own(4, 4, 4, 4, trials=4))
    with pytest.raises(InsufficientData, match="0 tools"):
        found(OWN, Evidence())
    untold = own(5, 5, 5, 5).deployment.drop(columns="solved_in_training")
    with pytest.raises(InsufficientData, match="says whether its policy solves the instance in training physics"):
        found(OWN, Evidence(deployment=untold))


def test_one_start_that_only_another_tool_solves_refutes_a_tool() -> None:
    finding = found(GRID, grid([0, 1, 2], [3], [], [0]))
    assert (finding.verdict, finding.value, finding.n) == (SUPPORTED, 0.75, "4 tools, 4 of 12 starts")


def test_a_tool_that_solves_all_that_any_solves_contradicts() -> None:
    finding = found(GRID, grid([0, 1], [1], [], []))
    assert (finding.verdict, finding.value) == (CONTRADICTED, 1.0)


def test_a_grid_that_nobody_solves_or_that_is_incomplete_says_nothing() -> None:
    with pytest.raises(InsufficientData, match="no tool solves any start"):
        found(GRID, grid([], [], [], []))
    whole = grid([0], [1], [2], [3])
    with pytest.raises(InsufficientData, match="8 starts of the grid"):
        found(GRID, Evidence(deployment=whole.deployment.query("row < 2")))
