"""Scoop 3D against its documentation: the tool's geometry, where balls lie, what counts as held, success and reward.

Nothing here depends on a tuned number: all of them are read from the task's module. Lengths are in m, times in s.
"""

from __future__ import annotations

from importlib import import_module
from itertools import product
from typing import Any

import numpy as np
import pybullet
import pytest

from codesign_bench.registry import load_module
from codesign_bench.task import Floats, load_task
from codesign_bench.task.episodes import Episodes

pytestmark = pytest.mark.numeric

scoop: Any = load_module("tasks", "scoop_3d")
script: Any = import_module("codesign_bench.tasks._scripts.scoop_3d")
SLOT = np.array([0])
LIFT = np.array([[0.0, 0.0, 1.0, 0.0, 0.0, 0.0]])


def tool_for(count: int) -> Floats:
    """Return the script's normalised tool (1, D) for a number of balls."""
    return np.array([script.Scoop3DScript.TOOLS[count - 1]])


def started(wanted: int, design: Floats, pile: int = 3) -> Episodes:
    """Return an episode behind its design step."""
    episodes = Episodes(load_task("scoop_3d"), 1)
    episodes.begin(SLOT, np.array([[float(wanted), float(pile)]]))
    episodes.design(SLOT, design)
    return episodes


def lift_to_the_end(episodes: Episodes) -> tuple[list[float], bool]:
    """Play the script's controller to the episode's end; return the rewards and whether it was cut by the limit."""
    lifting, rewards = load_task("scoop_3d").script(), []
    while True:
        reward, terminated, truncated = episodes.control(SLOT, lifting.act(episodes.observation).astype(np.float64))
        rewards.append(float(reward[0]))
        if terminated[0] or truncated[0]:
            return rewards, bool(truncated[0])


def box_tool(width: float, length: float, height: float, angle: float = 0.0) -> Floats:
    """Return a design (1, D) whose four sides are alike, in the design space's units."""
    return np.array([[width, length, *[height] * 4, *[angle] * 4]])


def test_an_upright_box_by_hand() -> None:
    thick = scoop.HALF_THICKNESS
    boxes = scoop.scoop_boxes(box_tool(0.12, 0.1, 0.06))
    _, back, bottom, front, left, right = range(6)
    np.testing.assert_allclose(boxes.half_extents[0, bottom], [0.06, 0.05, thick])
    np.testing.assert_allclose(boxes.half_extents[0, [back, front]], [[0.06, thick, 0.03]] * 2)
    np.testing.assert_allclose(boxes.half_extents[0, [left, right]], [[thick, 0.05, 0.03]] * 2)
    np.testing.assert_allclose(boxes.centres[0, front], [0.0, 0.05 + thick, 0.03 - thick])
    np.testing.assert_allclose(boxes.centres[0, back], [0.0, -0.05 - thick, 0.03 - thick])
    np.testing.assert_allclose(boxes.centres[0, right], [0.06 + thick, 0.0, 0.03 - thick])
    np.testing.assert_allclose(boxes.centres[0, left], [-0.06 - thick, 0.0, 0.03 - thick])


@pytest.mark.parametrize("angle", [-0.2, 0.0, 0.2])
def test_the_inner_faces_of_the_boxes_are_where_the_counting_takes_them_to_be(angle: float) -> None:
    design = box_tool(0.12, 0.1, 0.06, angle)
    boxes = scoop.scoop_boxes(design)
    matrices = scoop.rotation_matrices(boxes.rotations[0])
    for side, node in enumerate((1, 3, 4, 5)):
        axis = int(np.argmax(np.abs(scoop.OUTWARDS[side])))
        for up, face in product((-1.0, 1.0), (-1.0, 1.0)):  # Foot and rim of the inner and the outer face.
            corner = boxes.half_extents[0, node] * [0.0, 0.0, up]
            corner[axis] = face * scoop.OUTWARDS[side, axis] * scoop.HALF_THICKNESS
            point = boxes.centres[0, node] + matrices[node] @ corner
            distance = scoop.beyond_sides(design, point[None, None])[0, 0, side]
            assert distance == pytest.approx((1.0 + face) * scoop.HALF_THICKNESS, abs=1e-12)


def test_balls_above_the_bottom_and_between_the_sides_count_by_hand() -> None:
    points = np.array([[0.0, 0.0, 0.03], [0.0, 0.0, 0.2], [0.0, 0.0, -0.03], [0.08, 0.0, 0.03], [0.0, -0.07, 0.03]])
    upright = scoop.above_bottom(box_tool(0.12, 0.1, 0.06), points[None])[0]
    assert upright.tolist() == [True, True, False, False, False]
    open_above = scoop.above_bottom(box_tool(0.12, 0.1, 0.06, 0.25), np.array([[[0.08, 0.0, 0.06]]]))
    assert open_above.all(), "sides that lean outwards hold more"


def test_closeness_by_hand() -> None:
    values = scoop.closeness(np.array([3, 0, 7, 1]), np.array([3, 3, 3, 3]))
    np.testing.assert_allclose(values, np.array([1.0, 0.25, 0.5, 0.5]) ** scoop.CLOSENESS_POWER)


def test_the_lowest_point_of_a_tilted_plate_by_hand() -> None:
    design, thick = box_tool(0.12, 0.1, 0.06), scoop.HALF_THICKNESS
    about_x = scoop.turn_matrices(np.array([[0.2, 0.0, 0.0]]))
    assert scoop.drop(design, about_x)[0] == pytest.approx(0.05 * np.sin(0.2) + thick * np.cos(0.2))
    about_z = scoop.turn_matrices(np.array([[0.0, 0.0, 0.3]]))
    assert scoop.drop(design, about_z)[0] == pytest.approx(thick)


def profile_by_hand(places: Floats, velocities: Floats, middle: Floats) -> tuple[list[float], list[float]]:
    """Return what `profile` should say of the balls (N, 3), (N,) of one slot, place by place and ball by ball."""
    offsets = scoop.PROFILE_STEP * (np.arange(scoop.PROFILE_POINTS) - 0.5 * (scoop.PROFILE_POINTS - 1))
    surface, rise = [], []
    for offset in product(offsets, offsets):
        distances = np.linalg.norm(places[:, :2] - middle - offset, axis=1)
        reached = [
            (float(place[2] + np.sqrt(scoop.BALL_RADIUS**2 - distance**2)), float(velocity))
            for place, velocity, distance in zip(places, velocities, distances, strict=True)
            if distance < scoop.BALL_RADIUS
        ]
        height, velocity = max(reached, default=(0.0, 0.0))
        surface.append(height)
        rise.append(velocity)
    return surface, rise


def test_the_profile_of_two_balls_by_hand() -> None:
    radius, step, side = scoop.BALL_RADIUS, scoop.PROFILE_STEP, scoop.PROFILE_POINTS
    middle = side // 2
    places = np.full((1, scoop.BALLS, 3), 9.0)  # Out of sight; nothing of them may show at the edges.
    places[0, 0], places[0, 1] = (0.3, 0.1, 0.05), (0.3 + step, 0.1 - 0.5 * step, 0.2)
    surface, rise = scoop.profile(places, np.arange(scoop.BALLS)[None] + 0.5, np.array([[0.3, 0.1]]))
    across = 0.2 + np.sqrt(radius**2 - (0.5 * step) ** 2)
    expected, rising = np.zeros((side, side)), np.zeros((side, side))
    expected[middle, middle], rising[middle, middle] = 0.05 + radius, 0.5
    expected[middle + 1, [middle - 1, middle]], rising[middle + 1, [middle - 1, middle]] = across, 1.5
    np.testing.assert_allclose(surface[0].reshape(side, side), expected)
    np.testing.assert_allclose(rise[0].reshape(side, side), rising)


def test_the_state_shows_the_balls_before_there_is_a_tool_and_in_motion_after() -> None:
    task, rng, slots = load_task("scoop_3d"), np.random.default_rng(4), np.arange(3)
    episodes = Episodes(task, 3)
    simulator: Any = episodes.simulator
    episodes.begin(slots, task.sample_instances(rng, 3))
    seen = task.layout.split(episodes.observation).state
    for phase in ("design", "control", "control"):
        for slot in slots:
            middle = scoop.TOOL_START[:2] if phase == "design" else simulator.pose[slot, :2]
            balls = simulator.bodies[slot]
            surface, rise = profile_by_hand(balls[:, :3], balls[:, 9], middle)
            np.testing.assert_allclose(seen[slot, scoop.SURFACE], surface, atol=1e-6)
            np.testing.assert_allclose(seen[slot, scoop.RISE], rise, atol=1e-6)
            if phase == "design":
                assert 0.3 * scoop.PROFILE_POINTS**2 < np.count_nonzero(surface) < 0.7 * scoop.PROFILE_POINTS**2
                assert max(surface) <= 2.0 * scoop.BALL_RADIUS
                assert not any(rise)
        if phase == "design":
            episodes.design(slots, rng.uniform(-1.0, 1.0, size=(3, 10)))
        for _ in range(3):
            episodes.control(slots, rng.uniform(-1.0, 1.0, size=(3, 6)))
    assert np.abs(seen[:, scoop.RISE]).max() > 0.0


def test_the_profile_does_not_depend_on_the_balls_order_and_moves_with_the_tool() -> None:
    places, middle = scoop.lay_balls(np.random.default_rng(1))[None], np.array([scoop.TOOL_START[:2]])
    rises = np.arange(float(scoop.BALLS))[None]
    before = scoop.profile(places, rises, middle)
    np.testing.assert_array_equal(scoop.profile(places[:, ::-1], rises[:, ::-1], middle), before)
    np.testing.assert_allclose(
        scoop.profile(places + np.array([0.1, 0.2, 0.0]), rises, middle + np.array([0.1, 0.2])), before
    )


def test_the_profile_reaches_over_every_bottom_plate_and_no_ball_hides_between_its_places() -> None:
    reach = 0.5 * scoop.PROFILE_STEP * (scoop.PROFILE_POINTS - 1)
    assert reach > 0.5 * scoop.DESIGN.bounds[1][scoop.BOTTOM].max() + scoop.BALL_RADIUS
    assert np.sqrt(0.5) * scoop.PROFILE_STEP < scoop.BALL_RADIUS


def test_balls_thrown_anywhere_leave_the_observation_in_its_bounds() -> None:
    episodes = started(3, tool_for(3))
    simulator: Any = episodes.simulator
    low, high = load_task("scoop_3d").state_space.bounds
    for height, speed in ((5.0, 30.0), (-3.0, -30.0)):
        for ball in simulator.moving[0]:
            world = simulator.worlds[0]
            pybullet.resetBasePositionAndOrientation(ball, [0.0, 0.05, height], scoop.LEVEL, physicsClientId=world)
            pybullet.resetBaseVelocity(ball, [0.0, 0.0, speed], physicsClientId=world)
        episodes.control(SLOT, 0.0 * LIFT)
        state = load_task("scoop_3d").layout.split(episodes.observation).state[0]
        assert np.isfinite(state).all()
        assert ((low - 1e-4 <= state) & (state <= high + 1e-4)).all()


def test_instances_are_whole_numbers_of_balls_all_alike() -> None:
    wanted = load_task("scoop_3d").sample_instances(np.random.default_rng(0), 7_000)[:, scoop.BALLS_WANTED]
    counts = np.array([(wanted == number).sum() for number in range(scoop.WANTED[0], scoop.WANTED[1] + 1)])
    assert counts.sum() == 7_000
    assert np.abs(counts - 1_000).max() < 120  # Four standard deviations.


@pytest.mark.parametrize("seed", range(5))
def test_balls_lie_side_by_side_in_the_reservoir(seed: int) -> None:
    places = scoop.lay_balls(np.random.default_rng(seed))
    assert places.shape == (scoop.BALLS, 3)
    assert (np.abs(places[:, :2]) + scoop.BALL_RADIUS <= scoop.RESERVOIR).all()
    apart = np.linalg.norm(places[:, None] - places, axis=2) + np.eye(scoop.BALLS)
    assert apart.min() >= 2.0 * scoop.BALL_RADIUS


def test_nothing_overlaps_before_the_balls_are_poured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scoop, "SETTLING_STEPS", 0)
    task, rng = load_task("scoop_3d"), np.random.default_rng(2)
    alike = [
        (width, length, *[height] * 4, *[angle] * 4) for width, length, height, angle in product((-1.0, 1.0), repeat=4)
    ]
    designs = np.vstack([alike, rng.choice([-1.0, 1.0], size=(24, 10)), rng.uniform(-1.0, 1.0, size=(8, 10))])
    episodes, slots = Episodes(task, len(designs)), np.arange(len(designs))
    episodes.begin(slots, task.sample_instances(rng, len(designs)))
    episodes.design(slots, designs)
    assert max(episodes.simulator.inspect(slot).overlap for slot in range(len(designs))) < 1e-4


def test_the_right_number_held_for_long_enough_is_a_success() -> None:
    episodes = started(5, tool_for(5))
    rewards, _ = lift_to_the_end(episodes)
    assert episodes.success(SLOT).all()
    assert episodes.simulator.outcome[0] == 5
    assert episodes.simulator.state[0, scoop.HELD_SHARE] == 1.0
    assert rewards[-1] > 0.9 * scoop.SUCCESS_REWARD
    assert max(rewards[:-1]) < 0.5 * scoop.SUCCESS_REWARD


def test_a_wrong_number_fails_after_a_while_above_the_line() -> None:
    episodes = started(1, tool_for(6))
    rewards, truncated = lift_to_the_end(episodes)
    assert episodes.simulator.failure[0]
    assert not episodes.success(SLOT).any()
    assert not truncated
    assert episodes.simulator.outcome[0] > 1
    assert len(rewards) > scoop.LOST_STEPS


def test_an_idle_tool_holds_nothing_however_full_it_is() -> None:
    episodes = started(6, tool_for(6))
    assert episodes.simulator.state[0, scoop.BALLS_ABOVE] >= 6
    for _ in range(scoop.HELD_STEPS + 2):
        reward, terminated, _ = episodes.control(SLOT, 0.0 * LIFT)
        assert not terminated[0]
        assert abs(reward[0]) < 0.1
    assert episodes.simulator.outcome[0] == 0


def test_a_ball_that_flies_past_is_not_held() -> None:
    episodes = started(2, tool_for(1))
    simulator: Any = episodes.simulator
    for _ in range(12):
        episodes.control(SLOT, LIFT)
    assert simulator.outcome[0] == 1
    world, inside = simulator.worlds[0], scoop.above_bottom(simulator.designs, simulator.local)[0]
    ball = simulator.moving[0][int(np.flatnonzero(~inside)[0])]
    above = simulator.pose[0, :3] + [0.0, 0.0, 0.2]
    pybullet.resetBasePositionAndOrientation(ball, above, scoop.LEVEL, physicsClientId=world)
    pybullet.resetBaseVelocity(ball, [0.0, 0.0, 1.5], physicsClientId=world)
    episodes.control(SLOT, 0.0 * LIFT)
    assert simulator.state[0, scoop.BALLS_ABOVE] == 2, "above the tool"
    assert simulator.outcome[0] == 1, "but not held"
    assert simulator.met_steps[0] == 0


def test_rewards_add_up_to_the_documented_potential() -> None:
    episodes = started(3, tool_for(6))
    rewards, _ = lift_to_the_end(episodes)
    few, many = sorted((episodes.simulator.state[0, scoop.BALLS_ABOVE] + 1.0, 4.0))
    expected = scoop.PROGRESS_REWARD * (few / many) ** scoop.CLOSENESS_POWER + scoop.SLACK_REWARD * len(rewards)
    assert sum(rewards) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_the_tool_keeps_to_its_limits_whatever_the_control(seed: int) -> None:
    rng = np.random.default_rng(seed)
    episodes = started(3, tool_for(3 + seed))
    simulator: Any = episodes.simulator
    slack = 0.004
    for _ in range(25):
        before = simulator.pose[0].copy()
        episodes.control(SLOT, np.sign(rng.uniform(-1.0, 1.0, size=(1, 6))))
        after = simulator.pose[0]
        assert (np.abs(after - before)[:3] < scoop.CONTROL_SCALE + slack).all()
        assert (np.abs(after[:2] - scoop.TOOL_START[:2]) < np.array(scoop.REACH) + slack).all()
        assert (np.abs(after[3:]) < np.array(scoop.LARGEST_TURN) + 0.05).all()
        assert scoop.FLOOR_CLEARANCE < after[2] < scoop.HIGHEST + slack


def test_balls_that_are_not_scooped_stay_in_the_reservoir() -> None:
    episodes = started(5, tool_for(7))
    lift_to_the_end(episodes)
    simulator: Any = episodes.simulator
    balls = simulator.bodies[0, :, :3]
    assert (np.abs(balls[:, :2]) < scoop.RESERVOIR).all()
    low = balls[:, 2] < scoop.WALL_HEIGHT
    assert low.sum() + simulator.outcome[0] == scoop.BALLS
