"""Fetch cube against its documentation: frames, geometry, starts, the hand's reach, success, reward and friction.

Nothing here depends on a tuned number: all of them are read from the task's module. Lengths are in m, times in s.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
import pybullet
import pytest

from codesign_bench.registry import load_module
from codesign_bench.task import Floats, load_task
from codesign_bench.task.episodes import Episodes

pytestmark = pytest.mark.numeric

fetch: Any = load_module("tasks", "fetch_cube")
SLOT = np.array([0])
HALF = 0.5 * fetch.CUBE_SIZE
PULL, SIDEWAYS, IDLE = np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.0, 0.0]), np.zeros(3)


def design(lengths: Sequence[float], angles: Sequence[float], width: float = 0.02, height: float = 0.03) -> Floats:
    """Return the design (11,), in its units, of links that differ in their lengths alone; `angles` in degrees."""
    links = [size for length in lengths for size in (width, length, height)]
    return np.array([*links, *np.deg2rad(angles)])


HOOK = design((0.1, 0.1, 0.2), (0.0, -90.0))
"""Straight ahead for 0.2 m, then a hook to the right."""
STRAIGHT = design((0.1, 0.1, 0.1), (0.0, 0.0))


@dataclass
class Outcome:
    """One episode: rewards, the cube's place before and after every step, the held point's after it, and the end."""

    reward: list[float] = field(default_factory=list)
    cube: list[Floats] = field(default_factory=list)
    hold: list[Floats] = field(default_factory=list)
    success: bool = False

    @property
    def distances(self) -> Floats:
        """The cube's distance from the base."""
        distances: Floats = np.linalg.norm(np.array(self.cube)[:, :2], axis=1)
        return distances


def started(start: Sequence[float], tool: Floats) -> Episodes:
    """Return an episode whose cube starts at `start` (x, y), with a tool."""
    task = load_task("fetch_cube")
    episodes = Episodes(task, 1)
    episodes.begin(SLOT, np.array([start]))
    episodes.design(SLOT, task.design_space.to_unit(tool)[None])
    return episodes


def play(episodes: Episodes, control: Floats, steps: int | None = None) -> Outcome:
    """Play a started episode to its end, or for so many steps, with one and the same control (3,)."""
    simulator: Any = episodes.simulator
    outcome = Outcome(cube=[simulator.bodies[0, 0].copy()])
    for _ in range(steps or episodes.task.horizon):
        reward, terminated, truncated = episodes.control(SLOT, control[None])
        outcome.reward.append(float(reward[0]))
        outcome.cube.append(simulator.bodies[0, 0].copy())
        outcome.hold.append(simulator.pose[0].copy())
        outcome.success = bool(episodes.success(SLOT)[0])
        if terminated[0] or truncated[0]:
            break
    return outcome


def many_designs(count: int) -> Floats:
    """Return all corners of angles and lengths, thick and thin, and `count` designs inside, normalised."""
    size = load_task("fetch_cube").design_space.size
    corners = np.ones((64, size))
    corners[:, [0, 1, 4, 7, 9, 10]] = list(product((-1.0, 1.0), repeat=6))
    corners[:, [3, 6]] = corners[:, [0]]
    return np.vstack([corners, np.random.default_rng(7).uniform(-1.0, 1.0, size=(count, size))])


def test_the_chain_by_hand() -> None:
    points, boxes = fetch.chain_boxes(np.array([design((0.1, 0.2, 0.15), (90.0, 0.0)), HOOK]))
    np.testing.assert_allclose(points[0], [[0, 0], [0, 0.1], [-0.2, 0.1], [-0.35, 0.1]], atol=1e-12)  # To the left.
    np.testing.assert_allclose(points[1], [[0, 0], [0, 0.1], [0, 0.2], [0.2, 0.2]], atol=1e-12)
    np.testing.assert_allclose(boxes.centres[0, 1], [-0.1, 0.1, 0.0], atol=1e-12)
    np.testing.assert_allclose(boxes.half_extents[0, 1], [0.01, 0.1, 0.015], atol=1e-12)
    np.testing.assert_allclose(boxes.rotations[0, 1], [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)], atol=1e-12)


def test_the_frame_puts_the_papers_real_starts_into_the_region_and_its_hard_ones_beyond_success() -> None:
    for x, minus_y in ((-0.110, -0.803), (-0.339, -0.588), (0.155, -0.731), (0.211, -0.633)):  # Table of real starts.
        assert fetch.CUBE_X[0] < x < fetch.CUBE_X[1]
        assert fetch.CUBE_Y[0] - 0.004 < -minus_y < fetch.CUBE_Y[1] + 0.004
    places = load_task("fetch_cube").fine_tuning_instances()
    np.testing.assert_allclose(places[:, 0], [[-0.167, 0.833], [-0.129, 0.843], [0.430, 0.707], [0.415, 0.590]])
    np.testing.assert_allclose(np.linalg.norm(places - places[:, :1], axis=2)[:, 1:], fetch.FINE_TUNING_RADIUS)
    hard = places.reshape(-1, 2)
    assert np.linalg.norm(hard, axis=1).min() > fetch.GOAL_DISTANCE
    low, high = load_task("fetch_cube").instance_space.bounds
    assert (((hard < low) | (hard > high)).any(axis=1)).all(), "outside the training region"


def test_no_cube_starts_where_it_counts_as_fetched() -> None:
    starts = load_task("fetch_cube").sample_instances(np.random.default_rng(0), 10_000)
    assert np.linalg.norm(starts, axis=1).min() > fetch.GOAL_DISTANCE


def test_the_cutout_is_two_patches_with_a_gap_between_them() -> None:
    task, middle = load_task("fetch_cube"), 0.5 * sum(fetch.CUBE_Y)
    assert task.in_cutout(np.array([[-0.2, middle], [0.2, middle]]), 0.5).all()
    assert not task.in_cutout(np.array([[0.0, middle]]), 0.9).any(), "between the patches"


def test_material_by_hand() -> None:
    largest = design((0.2, 0.2, 0.2), (0.0, 0.0), width=0.03, height=0.04)
    small = design((0.1, 0.1, 0.1), (90.0, -90.0), width=0.015, height=0.01)  # Half as long and wide, a quarter high.
    np.testing.assert_allclose(load_task("fetch_cube").material(np.array([largest, small])), [1.0, 1.0 / 16.0])


def test_every_tool_starts_clear_of_its_cube_and_within_the_hands_reach() -> None:
    task, designs = load_task("fetch_cube"), many_designs(32)
    starts = task.sample_instances(np.random.default_rng(1), len(designs))
    starts[:4] = task.fine_tuning_instances()[:, 0]
    episodes, slots, places = Episodes(task, 8), np.arange(8), []
    simulator: Any = episodes.simulator
    for first in range(0, len(designs), slots.size):
        episodes.begin(slots, starts[first : first + slots.size])
        episodes.design(slots, designs[first : first + slots.size])
        places.extend(simulator.pose[:, 0].tolist())
        for slot in slots.tolist():  # By PyBullet's own account.
            tool, cube, world = simulator.tools[slot], simulator.moving[slot][0], simulator.worlds[slot]
            points = pybullet.getClosestPoints(tool, cube, 1.0, physicsClientId=world)
            assert min(point[8] for point in points) >= fetch.START_CLEARANCE - 1e-4
            assert simulator.inspect(slot).overlap < 1e-9
    assert len(places) == len(designs)
    assert 0 < sum(place != fetch.HOLD_START[0] for place in places) < len(places)
    assert max(np.abs(places)) <= fetch.HOLD_X[1]


def test_starts_are_found_for_every_tool_and_cube_and_are_left_alone_where_nothing_is_in_the_way() -> None:
    task, rng = load_task("fetch_cube"), np.random.default_rng(2)
    designs = np.where(rng.random((20_000, 1)) < 0.5, 1.0, 0.0) * np.sign(rng.uniform(-1.0, 1.0, size=(20_000, 11)))
    designs = np.where(designs == 0.0, rng.uniform(-1.0, 1.0, size=designs.shape), designs)
    points, boxes = fetch.chain_boxes(task.design_space.from_unit(designs))
    starts = task.sample_instances(rng, len(designs))
    offset = fetch.HOLD_START[:2] - starts
    shifts = fetch.start_shift(boxes, offset)
    assert np.abs(shifts).max() <= fetch.HOLD_X[1]
    share = np.linspace(0.0, 1.0, 21)[:, None]
    along = (points[:, :-1, None] * (1.0 - share) + points[:, 1:, None] * share).reshape(len(points), -1, 2)
    nearest = np.linalg.norm(along + offset[:, None], axis=2).min(axis=1)
    reach = np.sqrt(2.0) * HALF + 0.5 * fetch.SIZES[0][1] + np.sqrt(2.0) * fetch.START_CLEARANCE
    assert (shifts[nearest > reach + 0.02] == 0.0).all()
    assert (shifts[nearest < HALF] != 0.0).all()


def test_a_hook_behind_the_cube_fetches_it_with_one_pull() -> None:
    start = (0.0, 0.6)
    episodes = started(start, HOOK)
    simulator: Any = episodes.simulator
    # The stem would start on the cube: it starts left of it, where the hook lies behind the cube.
    assert simulator.pose[0, 0] == pytest.approx(-(HALF + 0.01 + fetch.START_CLEARANCE))
    outcome = play(episodes, PULL)
    assert outcome.success
    # The hook's near side must move from 0.69 to half a cube behind the goal's edge, 0.02 m in a step.
    assert len(outcome.reward) == pytest.approx((0.69 - (fetch.GOAL_DISTANCE + HALF)) / fetch.STEP_LENGTH, abs=2)
    assert outcome.reward[-1] > 0.9 * fetch.SUCCESS_REWARD
    assert max(outcome.reward[:-1]) < 0.1 * fetch.SUCCESS_REWARD
    assert outcome.distances[-1] < fetch.GOAL_DISTANCE < outcome.distances[-2]


def test_a_straight_tool_beside_the_cube_fetches_nothing() -> None:
    outcome = play(started((0.0, 0.6), STRAIGHT), PULL)
    assert not outcome.success
    assert len(outcome.reward) == load_task("fetch_cube").horizon
    assert outcome.distances[-1] == pytest.approx(outcome.distances[0], abs=1e-3)


def test_one_pull_does_not_fetch_a_far_cube() -> None:
    outcome = play(started((0.0, 0.77), design((0.2, 0.15, 0.2), (0.0, -90.0))), PULL)
    assert outcome.distances[-1] < outcome.distances[0] - 0.1
    assert not outcome.success
    np.testing.assert_allclose(outcome.hold[-1][1], fetch.HOLD_Y[0], atol=1e-3)


def test_nothing_happens_to_an_idle_tool() -> None:
    outcome = play(started((0.1, 0.6), HOOK), IDLE)
    np.testing.assert_allclose(outcome.cube[-1][:3], outcome.cube[0][:3], atol=1e-4)
    np.testing.assert_allclose(outcome.hold[-1], outcome.hold[0], atol=1e-4)
    horizon = load_task("fetch_cube").horizon
    assert sum(outcome.reward) == pytest.approx(horizon * fetch.SLACK_REWARD, abs=1e-3)


@pytest.mark.parametrize(("control", "tool"), [(PULL, HOOK), (SIDEWAYS, STRAIGHT), (SIDEWAYS, HOOK)])
def test_rewards_add_up_to_the_way_made(control: Floats, tool: Floats) -> None:
    outcome = play(started((0.02, 0.62), tool), control)
    way = outcome.distances[0] - outcome.distances[-1]
    assert abs(way) > 0.01, "the cube was moved"
    expected = fetch.PROGRESS_WEIGHT * way + fetch.SLACK_REWARD * len(outcome.reward)
    expected += fetch.SUCCESS_REWARD * outcome.success
    assert sum(outcome.reward) == pytest.approx(expected, abs=1e-9)


def test_the_hand_moves_as_far_as_documented_and_stays_in_its_box() -> None:
    outcome = play(started((0.39, 0.8), STRAIGHT), np.array([-1.0, -1.0, 1.0]))
    moves = np.diff(np.array(outcome.hold), axis=0)
    assert np.linalg.norm(moves[0, :2]) == pytest.approx(fetch.STEP_LENGTH, rel=0.02)
    np.testing.assert_allclose(outcome.hold[-1], [fetch.HOLD_X[0], fetch.HOLD_Y[0], fetch.HOLD_TOP], atol=1e-3)
    tall = design((0.1, 0.1, 0.1), (0.0, 0.0), height=fetch.SIZES[2][1])
    down = play(started((0.39, 0.8), tall), np.array([1.0, 1.0, -1.0]))
    floor = 0.5 * fetch.SIZES[2][1] + fetch.GROUND_CLEARANCE
    np.testing.assert_allclose(down.hold[-1], [fetch.HOLD_X[1], fetch.HOLD_Y[1], floor], atol=1e-3)


def test_the_tallest_tool_fits_beneath_the_overhang_and_the_thinnest_meets_the_cubes_side() -> None:
    low, high = fetch.SIZES[2]
    assert fetch.HOLD_TOP + 0.5 * high < fetch.OVERHANG_HEIGHT
    assert fetch.HOLD_TOP - 0.5 * low < fetch.CUBE_SIZE


def test_a_sliding_cube_stops_by_the_documented_friction() -> None:
    episodes, speed = started((0.3, 0.8), STRAIGHT), 0.6
    simulator: Any = episodes.simulator
    pybullet.resetBaseVelocity(simulator.moving[0][0], [0.0, speed, 0.0], physicsClientId=simulator.worlds[0])
    outcome = play(episodes, IDLE, steps=20)
    way = outcome.cube[-1][1] - outcome.cube[0][1]
    assert way == pytest.approx(speed**2 / (2.0 * fetch.TABLE_FRICTION * 9.81), rel=0.1)
    assert np.linalg.norm(outcome.cube[-1][7:10]) < 0.01


def test_the_mirror_image_of_an_episode_is_nearly_its_mirror_image() -> None:
    flip, control = np.array([1.0] * 9 + [-1.0, -1.0]), np.array([0.5, -1.0, 0.0])
    right = play(started((0.1, 0.62), HOOK), control, steps=10)
    left = play(started((-0.1, 0.62), HOOK * flip), control * (-1.0, 1.0, 1.0), steps=10)
    np.testing.assert_allclose(left.cube[-1][:2], right.cube[-1][:2] * (-1.0, 1.0), atol=5e-3)
    assert right.distances[-1] < right.distances[0] - 0.01
