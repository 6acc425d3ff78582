"""The deployment figure: its numbers are those of the trials, its maps lie as the paper's do."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_hex
from matplotlib.patches import Rectangle

from codesign_bench.errors import UserError

deployment: Any = import_module("codesign_bench.paper_figs.deployment")

SOLVED = {1: {(2, 0), (2, 1)}, 2: {(0, 3)}}
"""Tool -> starts of the grid (row, column) that it solves."""
NEARLY = {1: {(1, 1)}, 2: set[tuple[int, int]]()}


def trial(task: str, kind: str, tool: int, number: int, place: tuple[int, int], **ends: Any) -> dict[str, Any]:
    """Return one row of trials; without `ends`, a failure after 100 steps."""
    plain = {"success": 0, "near": 0, "steps": 100, "tracking_error_mean_mm": 1.0, "tracking_error_max_mm": 2.0}
    counted = {"unreachable_steps": 3, "scene_contact_steps": 0}
    where = {"task": task, "kind": kind, "tool": tool, "trial": number, "row": place[0], "column": place[1]}
    return {**where, **plain, **counted, **ends}


@pytest.fixture
def frame() -> pd.DataFrame:
    """Two tools of fetch cube on their own starts and the grid, and one of lift cup."""
    nowhere = (-1, -1)
    rows = [trial("lift_cup", "own", 1, number, nowhere, success=1, steps=50) for number in range(1, 6)]
    rows += [
        trial("fetch_cube", "own", tool, number, nowhere, success=int(number <= tool))
        for tool in (1, 2)
        for number in range(1, 6)
    ]
    rows += [
        trial("fetch_cube", "grid", tool, 1, place, success=int(place in SOLVED[tool]), near=int(place in NEARLY[tool]))
        for tool in (1, 2)
        for place in np.ndindex(3, 4)
    ]
    return pd.DataFrame(rows)


def test_the_table_counts_trials_beside_the_papers(frame: pd.DataFrame) -> None:
    table = deployment.data(frame)
    columns = ["task", "kind", "tool", "successes", "near", "trials", "paper_successes", "paper_trials"]
    assert table[columns].to_numpy().tolist() == [
        ["fetch_cube", "own", 1, 1, 0, 5, 5, 5],
        ["fetch_cube", "own", 2, 2, 0, 5, 5, 5],
        ["fetch_cube", "grid", 1, 2, 1, 12, 10, 12],
        ["fetch_cube", "grid", 2, 1, 0, 12, 4, 12],
        ["lift_cup", "own", 1, 5, 0, 5, 5, 5],
    ]
    assert table["unreachable_steps"].tolist() == [15, 15, 36, 36, 15]
    text = deployment.texts(frame)["md"]
    assert "| fetch cube, grid of starts | 2/12 (10/12) | 1/12 (4/12) | 1.0 mm, at most 2 | 3.0% of steps |" in text
    assert "| lift cup, own instance | 5/5 (5/5) | - |" in text


def test_maps_have_the_far_row_on_top_the_base_below_and_a_letter_besides_the_colour(frame: pd.DataFrame) -> None:
    figure = deployment.draw(frame)
    maps = [axes for axes in figure.axes if axes.get_title().startswith("tool ")]
    assert [axes.get_title() for axes in maps] == ["tool 1: 2 of 12", "tool 2: 1 of 12"]
    for tool, axes in enumerate(maps, start=1):
        fields = [patch for patch in axes.patches if isinstance(patch, Rectangle) and patch.get_fill()]
        letters = {text.get_position(): text.get_text() for text in axes.texts}
        assert len(fields) == 12
        for field in fields:
            x, y = field.get_xy()
            place = (2 - int(y), int(x))
            kind = "S" if place in SOLVED[tool] else "n" if place in NEARLY[tool] else "F"
            colour = {"S": deployment.SUCCESS, "n": deployment.NEAR, "F": deployment.FAILURE}[kind][0]
            assert to_hex(field.get_facecolor()) == colour.lower()
            assert letters[(x + 0.5, y + 0.5)] == kind
        (base,) = [text for text in axes.texts if text.get_text() == "base"]
        assert base.get_position()[1] < 0.0


def test_without_a_grid_the_table_stands_alone(frame: pd.DataFrame) -> None:
    figure = deployment.draw(frame[frame["kind"] == "own"])
    assert len(figure.axes) == 1


def test_trials_that_lack_a_column_are_refused(frame: pd.DataFrame) -> None:
    with pytest.raises(UserError, match="lack the column near"):
        deployment.data(frame.drop(columns="near"))
    with pytest.raises(UserError, match="have no rows"):
        deployment.data(frame.iloc[:0])


def test_several_policies_share_a_field_and_their_successes_are_summed(frame: pd.DataFrame) -> None:
    other = frame.assign(success=1, near=0)
    both = pd.concat([other.assign(policy_seed=101), frame.assign(policy_seed=100)])
    table = deployment.data(both)
    assert table["trials"].tolist() == [10, 10, 24, 24, 10]
    assert table["successes"].tolist() == [1 + 5, 2 + 5, 2 + 12, 1 + 12, 5 + 5]
    figure = deployment.draw(both)
    assert "of 2 policies each" in figure.axes[0].get_title()
    fewer = both[(both["task"] == "fetch_cube") | (both["policy_seed"] == 100)]
    assert "of 1 to 2 policies each" in deployment.draw(fewer).axes[0].get_title(), "lift cup has one"
    (one,) = [axes for axes in figure.axes if axes.get_title() == "tool 1: 14 of 24"]
    texts = {text.get_position(): text.get_text() for text in one.texts}
    assert texts[(0.5, 0.5)] == "2/2", "row 2, column 0: both policies solve it"
    assert texts[(0.5, 2.5)] == "1/2", "row 0, column 0: the second one alone"
    strips = {patch.get_xy(): to_hex(patch.get_facecolor()) for patch in one.patches if isinstance(patch, Rectangle)}
    assert strips[(0.5, 2.0)] == deployment.SUCCESS[0].lower(), "strips lie in the order of the seeds"
