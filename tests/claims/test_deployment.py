"""Rules about deployed tools give each verdict where they should."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
import pytest

from codesign_bench.claims import deployment
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import CONTRADICTED, SUPPORTED, InsufficientData
from evidence import found

OWN = deployment.own_instance_solved("fetch_cube", "gnn_ppo", tools=4, trials=5)
GRID = deployment.no_tool_solves_the_grid("fetch_cube", "gnn_ppo", tools=4, starts=12)


def own(*solved: int, trials: int = 5) -> Evidence:
    """Return trials on own instances: tool t succeeds in the first `solved[t]` of them."""
    rows = [
        {"task": "fetch_cube", "kind": "own", "tool": tool, "row": -1, "column": -1, "success": int(number < wins)}
        for tool, wins in enumerate(solved, start=1)
        for number in range(trials)
    ]
    return Evidence(deployment=pd.DataFrame(rows))


def grid(*solved: Sequence[int]) -> Evidence:
    """Return trials on the grid: tool t solves the starts numbered `solved[t]` of twelve."""
    where = {"task": "fetch_cube", "kind": "grid"}
    rows = [
        {**where, "tool": tool, "row": row, "column": column, "success": int(number in won)}
        for tool, won in enumerate(solved, start=1)
        for number, (row, column) in enumerate(np.ndindex(3, 4))
    ]
    return Evidence(deployment=pd.DataFrame(rows))


def test_every_tool_must_succeed_in_most_of_its_trials() -> None:
    finding = found(OWN, own(5, 4, 3, 3))
    assert (finding.verdict, finding.value, finding.n) == (SUPPORTED, 1.0, "4 tools, 20 trials")
    finding = found(OWN, own(5, 5, 5, 2))
    assert (finding.verdict, finding.value) == (CONTRADICTED, 0.75)
    assert finding.note == "successes by tool: 5/5, 5/5, 5/5, 2/5"


def test_too_few_tools_or_trials_say_nothing() -> None:
    with pytest.raises(InsufficientData, match="3 tools of fetch_cube"):
        found(OWN, own(5, 5, 5))
    with pytest.raises(InsufficientData, match="4 trials of a tool"):
        found(OWN, own(4, 4, 4, 4, trials=4))
    with pytest.raises(InsufficientData, match="0 tools"):
        found(OWN, Evidence())


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
