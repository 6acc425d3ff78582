"""Pictures of designed tools: goals spread over the goal space, drawn as the cell's evaluation recorded them."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from builders import VERSION_0_1_0
from codesign_bench.errors import UserError
from codesign_bench.figures.designed_tools import LINE_LENGTH, Place, designed_tools, spread
from codesign_bench.figures.drawing import draw_figures
from codesign_bench.figures.source import Request
from codesign_bench.storage.policies import load_policy
from codesign_bench.task import load_task
from codesign_bench.task.episodes import Episodes

CELL = Path("push", "gnn_ppo", "default", "seed-00")


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """Return a folder with one finished cell of push."""
    shutil.copytree(VERSION_0_1_0 / CELL, tmp_path / "runs" / CELL)
    return tmp_path / "runs"


def test_few_distinct_goals_get_one_picture_each_from_low_to_high() -> None:
    assert spread(np.array([[3.0], [1.0], [3.0], [2.0]])) == [Place(1, 0, 0), Place(3, 0, 1), Place(0, 0, 2)]


def test_many_goals_on_a_line_get_one_picture_per_stretch_and_gaps_are_passed_over() -> None:
    near, far = np.linspace(0.0, 0.98, 50), np.linspace(3.0, 4.0, 50)
    goals = np.concatenate([near, far])
    places = spread(goals[:, None])
    values = [goals[place.instance] for place in places]
    # Stretches are half a unit long: two of eight in 0..1, two in 3..4, four between them without any goal.
    assert LINE_LENGTH == 8
    assert values == pytest.approx([0.25, 0.75, 3.25, 3.75], abs=0.02)
    assert [place.column for place in places] == [0, 1, 2, 3]


def test_goals_of_two_entries_lie_as_on_a_map() -> None:
    goals = np.array([(x, y) for x in (0.0, 1.0, 2.0) for y in (0.0, 5.0, 10.0)])
    at = {(place.row, place.column): goals[place.instance].tolist() for place in spread(goals)}
    assert len(at) == 9
    assert at[0, 0] == [0.0, 10.0]  # Top left: small x, large y.
    assert at[2, 2] == [2.0, 0.0]


def test_a_field_of_the_map_without_goals_stays_empty() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    fields = {(place.row, place.column) for place in spread(ring)}
    assert fields == {(row, column) for row in range(3) for column in range(3)} - {(1, 1)}


def test_a_picture_shows_the_tool_that_the_policy_makes_for_its_goal(results: Path) -> None:
    frame = designed_tools(Request(results))
    assert len(frame) == 8  # The ring of goals around the puck leaves the middle field empty.
    row = frame.iloc[3]
    task, slot = load_task("push"), np.array([0])
    episodes = Episodes(task, 1)
    instance = task.evaluation_instances()[row["instance"]]
    assert row[["instance_goal_x", "instance_goal_y"]].tolist() == pytest.approx(instance.tolist())
    episodes.begin(slot, instance[None])
    episodes.design(slot, np.asarray(load_policy(results / CELL).design(episodes.observation), dtype=np.float64))
    assert np.array_equal(row["picture"], episodes.simulator.render(0))
    assert row["goal"] == f"goal x: {instance[0]:.3g} m, goal y: {instance[1]:.3g} m"


def test_the_lowest_seed_of_the_first_method_is_drawn(results: Path) -> None:
    for cell in ("push/gnn_ppo/default/seed-01", "push/cma_es/default/seed-00"):
        shutil.copytree(VERSION_0_1_0 / cell, results / cell)
    shutil.rmtree(results / CELL)
    frame = designed_tools(Request(results))
    assert set(zip(frame["method"], frame["seed"], strict=True)) == {("gnn_ppo", 1)}


def test_a_cell_of_another_version_of_the_task_is_left_out_by_name(results: Path) -> None:
    path = results / CELL / "evaluation.csv"
    pd.read_csv(path).rename(columns={"design_link_1_length": "design_first_length"}).to_csv(path, index=False)
    told: list[str] = []
    with pytest.raises(UserError, match="no finished cell in"):
        designed_tools(Request(results, told.append))
    assert "push left out: its evaluation lacks design_link_1_length" in told[0]


def test_the_figure_comes_from_the_command_line(results: Path, tmp_path: Path) -> None:
    told: list[str] = []
    draw_figures(["qualitative_tools", "learning_curves"], results, tmp_path / "figures", told.append)
    assert Path(told[-1]).name == "qualitative_tools.png"  # What was asked for first is told last, where eyes are.
    table = pd.read_csv(tmp_path / "figures" / "qualitative_tools.csv")
    assert len(table) == 8
    assert table["design_link_1_length"].between(1.0, 3.0).all()
    assert "picture" not in table.columns
