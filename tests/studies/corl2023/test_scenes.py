"""What runs beside what the paper prints, row by row: the same, or different for a reason that stands here.

A task spells its own numbers and says which row of the paper each stands for (`Given.row`); the paper's numbers are the
study's. Rows are (task, row); values are plain numbers and tuples, in the units of the paper's tables.
"""

from __future__ import annotations

from dataclasses import fields
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pytest

from codesign_bench.studies.corl2023.protocol import PROTOCOL
from codesign_bench.studies.corl2023.real_robot import REAL_ROBOT
from codesign_bench.studies.corl2023.scenes import BOX_SCENES, PLANAR_SCENES, SCENES, UNUSED
from codesign_bench.task import deployment_of, load_task
from codesign_bench.task.scene import by_row

REGION = PROTOCOL.fetch_cube_region
TRIALS = {name: getattr(REAL_ROBOT, name) for name in ("trials", "max_steps", "near_miss")}
FETCH_CUBE = {
    "fetch_cube_region.x": REGION.x,
    "fetch_cube_region.y": REGION.y,
    "fine_tuning_starts": PROTOCOL.fine_tuning_starts,
    **{name: getattr(REAL_ROBOT, name) for name in ("fetch_cube_starts", "grid_shape", "grid_extent")},
    "fetch_cube_distance": REAL_ROBOT.fetch_cube_distance,
    **TRIALS,
}
LIFT_CUP = {"lift_cup_sizes": REAL_ROBOT.lift_cup_sizes, "lift_cup_height": REAL_ROBOT.lift_cup_height, **TRIALS}
RESULTS = {"own_successes", "grid_successes"}
"""Rows of `REAL_ROBOT` that are no part of a scene."""


class Difference(NamedTuple):
    """A row that runs with another value than the printed one."""

    printed: Any
    runs: Any
    why: str


DIFFERENCES = {
    ("push", "control_steps_per_action"): Difference(1, 2, "a physics step as short as the early scenes'"),
    ("catch_balls", "control_steps_per_action"): Difference(
        1, 4, "no ball that hits a tool moves a third of its radius"
    ),
    ("fetch_cube", "control_action_scale"): Difference(0.1, 0.02, "2.4 m/s would shoot cubes from the table"),
    ("lift_cup", "control_action_scale"): Difference(0.1, 0.02, "2.4 m/s would bat cups away"),
    ("scoop_3d", "control_action_scale"): Difference(0.05, 0.015, "1.5 m/s would throw balls about"),
    ("scoop_3d", "control_steps_per_action"): Difference(10, 4, "its length is unknown, and four are enough"),
    ("scoop_3d", "tool_position_init"): Difference((0.0, 0.05, 0.1), (0.0, 0.05, 0.009), "0.1 m is above the balls"),
    **{
        (task, f"control_action_{end}"): Difference(
            getattr(BOX_SCENES[task], f"control_action_{end}"), (sign,) * 3, "tools are moved, not turned"
        )
        for task in ("fetch_cube", "lift_cup")
        for end, sign in (("min", -1.0), ("max", 1.0))
    },
}
"""Where the task deliberately departs from the paper."""


def printed() -> dict[tuple[str, str], Any]:
    """Return every row of the paper that describes a scene or its trials."""
    tables = {
        task: {field.name: getattr(scene, field.name) for field in fields(scene)} for task, scene in SCENES.items()
    }
    tables["fetch_cube"] |= FETCH_CUBE
    tables["lift_cup"] |= LIFT_CUP
    return {(task, row): _one_angle(row, value) for task, rows in tables.items() for row, value in rows.items()}


def runs() -> dict[tuple[str, str], Any]:
    """Return the rows for which a constant of a task stands."""
    return {
        (task, row): _plain(constant.value)
        for task in SCENES
        for row, constant in by_row(load_task(task).scene).items()
    }


def _one_angle(row: str, value: Any) -> Any:
    """Return one bound for all joints: the tables print three alike, whatever the number of joints."""
    if row not in ("tool_angle_min", "tool_angle_max"):
        return value
    assert len(set(value)) == 1
    return value[0]


def _plain(value: Any) -> Any:
    return tuple(value.tolist()) if isinstance(value, np.ndarray) else value


PRINTED, RUNS = printed(), runs()


def test_every_row_of_the_paper_is_in_a_scene_or_left_out_for_a_reason() -> None:
    unused = {tuple(row.split(": ")) for row in UNUSED}
    assert set(RUNS) | unused == set(PRINTED)
    assert set(RUNS) & unused == set()
    listed = {name.split(".")[0] for rows in (FETCH_CUBE, LIFT_CUP) for name in rows} | RESULTS
    assert {field.name for field in fields(REAL_ROBOT)} <= listed


@pytest.mark.parametrize("row", sorted(RUNS), ids=" ".join)
def test_what_runs_is_what_is_printed_or_a_known_difference(row: tuple[str, str]) -> None:
    if row in DIFFERENCES:
        assert (PRINTED[row], RUNS[row]) == (DIFFERENCES[row].printed, pytest.approx(DIFFERENCES[row].runs))
        assert PRINTED[row] != RUNS[row]
    else:
        assert RUNS[row] == PRINTED[row]


@pytest.mark.parametrize("row", sorted(RUNS), ids=" ".join)
def test_a_constant_names_the_paper_as_its_source_if_it_has_the_printed_value(row: tuple[str, str]) -> None:
    (constant,) = (one for one in load_task(row[0]).scene.values() if one.row == row[1])
    assert "paper" in constant.source if row not in DIFFERENCES else "ours" in constant.source


@pytest.mark.parametrize("name", SCENES)
def test_the_task_does_what_its_constants_say(name: str) -> None:
    task, rows = load_task(name), {row: value for (task, row), value in RUNS.items() if task == name}
    assert task.horizon == rows["max_episode_steps"]
    simulator: Any = task.make_simulator(1)
    assert simulator.clock.steps == rows["control_steps_per_action"]


@pytest.mark.parametrize("name", PLANAR_SCENES)
def test_the_design_space_of_a_chain_follows_from_the_printed_rows(name: str) -> None:
    scene, space = PLANAR_SCENES[name], load_task(name).design_space
    angles = np.deg2rad(np.multiply(scene.tool_angle_ratio, scene.tool_angle_scale))
    for index, length in enumerate(scene.tool_length_init):
        expected = [length * (1.0 + ratio) for ratio in scene.tool_length_ratio]
        assert [bound[index] for bound in space.bounds] == pytest.approx(expected)
    for joint in ("joint_1_angle", "joint_2_angle"):
        assert [bound[space.index(joint)] for bound in space.bounds] == pytest.approx(angles)


@pytest.mark.parametrize("name", BOX_SCENES)
def test_the_design_space_of_boxes_follows_from_the_printed_rows_read_as_half_extents(name: str) -> None:
    scene, space = BOX_SCENES[name], load_task(name).design_space
    sizes = {
        (2.0 * low, 2.0 * high) for low, high in zip(scene.box_dimensions_min, scene.box_dimensions_max, strict=True)
    }
    angles = tuple(np.deg2rad([scene.tool_angle_min[0], scene.tool_angle_max[0]]))
    for entry, unit, low, high in zip(space.names, space.units, space.low, space.high, strict=True):
        assert (low, high) in sizes if unit == "m" else (low, high) == angles, entry


def test_the_trials_of_a_deployment_are_the_papers() -> None:
    for name in REAL_ROBOT.own_successes:
        trials = deployment_of(load_task(name)).trials
        assert trials.trials_per_tool == REAL_ROBOT.trials
        assert trials.max_steps == REAL_ROBOT.max_steps
        assert trials.near_miss == REAL_ROBOT.near_miss
    fetch, lift = (deployment_of(load_task(name)).trials for name in ("fetch_cube", "lift_cup"))
    np.testing.assert_array_equal(fetch.own, -np.array(REAL_ROBOT.fetch_cube_starts)[:, :2])
    assert fetch.grid.shape[:2] == REAL_ROBOT.grid_shape
    assert (np.ptp(fetch.grid[..., 1]), np.ptp(fetch.grid[..., 0])) == pytest.approx(REAL_ROBOT.grid_extent)
    np.testing.assert_array_equal(lift.own, REAL_ROBOT.lift_cup_sizes)
    assert (fetch.success_outcome, lift.success_outcome) == (REAL_ROBOT.fetch_cube_distance, REAL_ROBOT.lift_cup_height)


def test_the_papers_patches_are_the_cutout_of_six_tenths() -> None:
    task, inside = load_task("fetch_cube"), 0.002
    origin = task.scene["PAPER_ORIGIN"].value
    for patch in PROTOCOL.fetch_cube_patches:
        for sign, expected in ((1.0, True), (-1.0, False)):
            (x_low, x_high), (y_low, y_high) = patch.x, patch.y
            shift = sign * inside
            corners = product((x_low + shift, x_high - shift), (y_low + shift, y_high - shift))
            starts = np.array([(x, origin - y) for x, y in corners])
            assert (task.in_cutout(starts, 0.6) == expected).all()
