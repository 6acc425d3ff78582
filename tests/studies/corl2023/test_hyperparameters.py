"""The table of hyperparameters says what simulators and configurations do, beside what the paper prints."""

from __future__ import annotations

import ast
import sys
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from codesign_bench.config.resolve import resolve
from codesign_bench.errors import UserError
from codesign_bench.figures.drawing import draw_figures
from codesign_bench.method import load_method
from codesign_bench.studies.corl2023.hyperparameters import NOT_USED, SCENE, as_text, hyperparameters, same_value
from codesign_bench.studies.corl2023.learners import LEARNERS
from codesign_bench.studies.corl2023.scenes import BOX_SCENES, PLANAR_SCENES, SCENES, UNUSED
from codesign_bench.task import Task, load_task


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2e-5, "2e-5"),
        (3e-4, "3e-4"),
        (1.5e-4, "1.5e-4"),
        (0.005, "0.005"),
        (-0.001, "-0.001"),
        (0.0, "0.0"),
        (0.004 + 0.005, "0.009"),
        (50000, "50000"),
        (True, "True"),
        (None, "None"),
        ("joint", "joint"),
        ((64, 64, 64), "(64, 64, 64)"),
        ([0.005, 0.05], "(0.005, 0.05)"),
    ],
)
def test_values_are_written_as_the_paper_prints_them(value: Any, text: str) -> None:
    assert as_text(value) == text


@pytest.mark.parametrize("task", SCENES)
def test_the_paper_profile_holds_the_papers_table(task: str) -> None:
    table = hyperparameters(["gnn_ppo"], [task]).set_index(["method", "name"])["paper"]
    for field in fields(LEARNERS[task]):
        assert table["gnn_ppo", field.name] == as_text(getattr(LEARNERS[task], field.name))
    printed = hyperparameters([], [task]).set_index("name")["printed_value"]
    for field in fields(SCENES[task]):
        assert printed[field.name] == as_text(getattr(SCENES[task], field.name))


def table_of(task: str) -> pd.DataFrame:
    """Return the rows of a scene, by name."""
    table = hyperparameters([], [task])
    return table[table["method"] == SCENE].set_index("name")


def used(table: pd.DataFrame) -> dict[str, Any]:
    """Return the values that a table says are in use, as numbers."""
    return {str(name): ast.literal_eval(text) for name, text in table["laptop"].items() if text != NOT_USED}


def start_of_tool(task: Task, simulator: Any, instance: np.ndarray) -> list[float]:
    """Return where an episode's tool starts before a design moves it, without the shift that an instance may hold."""
    if hasattr(simulator, "pose") and simulator.pose[0].any():
        return simulator.pose[0, :3].tolist()
    module: Any = sys.modules[type(task).__module__]
    if hasattr(module, "TOOL_PLACE"):
        return simulator.state[0, module.TOOL_PLACE].tolist()
    place = simulator.bodies[0, module.TOOL_BODY, :2].copy()
    if hasattr(module, "SHIFT"):
        place[0] -= instance[0, module.SHIFT].item()
    return place.tolist()


@pytest.mark.parametrize("name", SCENES)
def test_the_table_prints_the_steps_starts_and_rewards_of_the_simulator(name: str) -> None:
    task, slots = load_task(name), np.array([0])
    simulator: Any = task.make_simulator(1)
    instance = task.sample_instances(np.random.default_rng(0), 1)
    simulator.begin(slots, instance)
    found: dict[str, Any] = {
        "control_steps_per_action": simulator.clock.steps,
        "max_episode_steps": task.horizon,
        "tool_position_init": tuple(start_of_tool(task, simulator, instance)),
    }
    simulator.build(slots, task.design_space.from_unit(np.zeros((1, task.design_space.size))))
    simulator.set_success = lambda slots, *_, **__: simulator.success.__setitem__(slots, True)
    simulator.step(slots, np.zeros((1, task.control_space.size)))
    found["slack_reward"] = simulator.reward_terms["slack"][0]
    if name in BOX_SCENES:
        found["success_reward"] = simulator.reward_terms["success"][0]
    told = used(table_of(name))
    assert {row: told[row] for row in found} == {row: pytest.approx(value) for row, value in found.items()}


@pytest.mark.parametrize("name", PLANAR_SCENES)
def test_the_table_prints_what_the_design_space_of_a_chain_is_made_from(name: str) -> None:
    told, space = used(table_of(name)), load_task(name).design_space
    for index, length in enumerate(told["tool_length_init"]):
        expected = [length * (1.0 + ratio) for ratio in told["tool_length_ratio"]]
        assert [bound[index] for bound in space.bounds] == pytest.approx(expected)
    angles = np.deg2rad(np.multiply(told["tool_angle_ratio"], told["tool_angle_scale"]))
    for joint in ("joint_1_angle", "joint_2_angle"):
        assert [bound[space.index(joint)] for bound in space.bounds] == pytest.approx(angles)


@pytest.mark.parametrize("name", BOX_SCENES)
def test_the_table_prints_what_the_design_space_of_boxes_is_made_from(name: str) -> None:
    told, space = used(table_of(name)), load_task(name).design_space
    lows, highs = np.multiply(2.0, told["box_dimensions_min"]), np.multiply(2.0, told["box_dimensions_max"])
    angles = tuple(np.deg2rad([told["tool_angle_min"], told["tool_angle_max"]]).tolist())
    found = {(low, high) for low, high, unit in zip(space.low, space.high, space.units, strict=True) if unit == "m"}
    assert found <= set(zip(lows.tolist(), highs.tolist(), strict=True))
    turns = {(low, high) for low, high, unit in zip(space.low, space.high, space.units, strict=True) if unit == "rad"}
    assert turns == {angles}


@pytest.mark.parametrize("name", BOX_SCENES)
def test_the_table_prints_how_far_a_control_moves_the_tool(name: str) -> None:
    task, slots, told = load_task(name), np.array([0]), used(table_of(name))
    simulator: Any = task.make_simulator(1)
    simulator.begin(slots, task.sample_instances(np.random.default_rng(0), 1))
    simulator.build(slots, task.design_space.from_unit(np.zeros((1, task.design_space.size))))
    moves: list[np.ndarray] = []
    simulator.drive = lambda slots, displacements: moves.append(displacements[0])
    turning = [task.control_space.index("turn_x")] if "turn_x" in task.control_space.names else []
    for entry in (task.control_space.index("move_x"), *turning):
        for sign, bounds in ((-1.0, told["control_action_min"]), (1.0, told["control_action_max"])):
            assert len(bounds) == task.control_space.size
            simulator.step(slots, sign * np.eye(task.control_space.size)[[entry]])
            assert moves[-1][entry] == pytest.approx(told["control_action_scale"] * bounds[entry], rel=1e-3)


def test_every_row_of_every_scene_is_in_the_table_and_what_no_task_uses_is_named() -> None:
    for name, scene in SCENES.items():
        table = table_of(name)
        assert list(table.index) == [field.name for field in fields(scene)]
        not_used = table.index[table["laptop"] == NOT_USED].tolist()
        assert not_used == (["tool_angle_init"] if name in PLANAR_SCENES else [])
        assert not_used == [] or table.loc[not_used, "laptop_source"].tolist() == [UNUSED[f"{name}: tool_angle_init"]]


def test_differences_from_the_paper_are_marked_and_nothing_else() -> None:
    bounds = ["control_action_min", "control_action_max"]
    assert {name: table_of(name).query("laptop_differs != ''").index.tolist() for name in SCENES} == {
        "push": ["control_steps_per_action"],
        "catch_balls": ["control_steps_per_action"],
        "scoop": [],
        "fetch_cube": [*bounds, "control_action_scale"],
        "lift_cup": [*bounds, "control_action_scale"],
        "scoop_3d": ["tool_position_init", "control_steps_per_action", "control_action_scale"],
    }
    row = table_of("scoop_3d").loc["control_steps_per_action"]
    assert (row["printed_value"], row["paper"], row["laptop"]) == ("10", "4", "4")
    assert (row["paper_source"], row["laptop_source"]) == ("ours", "ours")


def test_a_constant_with_another_value_changes_the_table(monkeypatch: pytest.MonkeyPatch) -> None:
    task = load_task("push")
    assert table_of("push").loc["max_episode_steps", "laptop_differs"] == ""
    changed = {**task.scene, "HORIZON": replace(task.scene["HORIZON"], value=120, source="ours")}
    monkeypatch.setattr(type(task), "scene", changed)
    row = table_of("push").loc["max_episode_steps"]
    assert (row["printed_value"], row["laptop"], row["laptop_differs"], row["laptop_source"]) == (
        "150",
        "120",
        "differs",
        "ours",
    )


@pytest.mark.parametrize(
    ("printed", "runs", "same"),
    [
        ((20, 10), np.array([20.0, 10.0]), True),
        ((-90.0, -90.0, -90.0), -90.0, True),
        ((-90.0, -90.0, -80.0), -90.0, False),
        ((1.0, 1.0, 0.2), (1.0, 1.0), False),
        (1, 2, False),
    ],
)
def test_numbers_are_compared_by_value_and_one_stands_for_equal_ones(printed: Any, runs: Any, same: bool) -> None:
    assert same_value(printed, runs) == same


def test_every_profile_stands_beside_the_source_of_its_value() -> None:
    table = hyperparameters(["cma_rl"], ["scoop_3d"]).set_index("name")
    laptop = resolve(load_method("cma_rl"), "scoop_3d", "laptop")
    assert table.loc["batch_size", "paper"] == "20000"
    assert table.loc["batch_size", "paper_source"] == "paper, table of baseline hyperparameters"
    assert table.loc["gamma", "laptop"] == str(laptop.method.gamma)
    assert table.loc["gamma", "laptop_source"] == laptop.sources["method.gamma"]


def test_the_tables_need_no_results_when_asked_for_by_name(tmp_path: Path) -> None:
    draw_figures(["hyperparameter_tables"], tmp_path / "none", tmp_path / "figures", print)
    assert {path.suffix for path in (tmp_path / "figures").iterdir()} == {".csv", ".md", ".pdf", ".png", ".tex"}
    table = pd.read_csv(tmp_path / "figures" / "hyperparameter_tables.csv")
    assert table["task"].unique().tolist() == list(SCENES)
    (tmp_path / "empty").mkdir()
    with pytest.raises(UserError, match="can be plotted yet"):
        draw_figures([], tmp_path / "empty", tmp_path / "figures", print)
