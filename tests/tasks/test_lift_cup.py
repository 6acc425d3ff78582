"""Lift cup against its documentation: fork and cup by hand, success, failure, reward, and which forks lift which cups.

Nothing here depends on a tuned number: all of them are read from the task's module. Lengths are in m, angles in rad.
"""

from __future__ import annotations

import inspect
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

lift: Any = load_module("tasks", "lift_cup")
bullet: Any = inspect.getmodule(lift.BulletSimulator)
SLOT = np.array([0])
SMALL, MIDDLE, WIDE = ((0.3, 0.6), (0.5, 0.8), (0.9, 0.9))
"""Cups (scales of width and height); the paper made tools for (0.3, 0.6) and (0.5, 0.8), too."""


@dataclass
class Outcome:
    """One episode: its rewards, how it ended, and the simulator at its end."""

    simulator: Any
    reward: list[float] = field(default_factory=list)
    success: bool = False
    failure: bool = False


def fork(cup: tuple[float, float], clearance: float, **changes: float) -> Floats:
    """Return the normalised design (1, 5) with so much free width at each side of a cup, long and level."""
    space = load_task("lift_cup").design_space
    entries = {
        "prong_distance": lift.CUP_UNIT * cup[0] + 2.0 * clearance,
        "prong_tilt": 0.0,
        "prong_width": 0.015,
        "prong_length": 0.2,
        "prong_height": 0.04,
    }
    return space.to_unit([[(entries | changes)[name] for name in space.names]])


def start(cup: tuple[float, float], design: Floats) -> Episodes:
    """Return an episode right after its design step."""
    episodes = Episodes(load_task("lift_cup"), 1)
    episodes.begin(SLOT, np.array([cup]))
    episodes.design(SLOT, design)
    return episodes


def play(cup: tuple[float, float], design: Floats) -> Outcome:
    """Play one episode of the script's controller with a given tool."""
    episodes, script = start(cup, design), load_task("lift_cup").script()
    outcome = Outcome(episodes.simulator)
    while True:
        reward, terminated, truncated = episodes.control(SLOT, script.act(episodes.observation).astype(float))
        outcome.reward.append(float(reward[0]))
        if terminated[0] or truncated[0]:
            outcome.success, outcome.failure = bool(episodes.success(SLOT)[0]), bool(outcome.simulator.failure[0])
            return outcome


def put_cup(simulator: Any, lowest: float, tilt: float, x: float = 0.0) -> None:
    """Put the cup of slot 0, tilted about x, at rest where its lowest corner has the height `lowest`."""
    width, centre = simulator.size[0, 0], simulator.centre_height[0]
    place = (x, lift.CUP_START_Y, lowest + centre * np.cos(tilt) + 0.5 * width * abs(np.sin(tilt)))
    rotation = bullet.rotations_about(0, np.array(tilt)).tolist()
    world = simulator.worlds[0]
    pybullet.resetBasePositionAndOrientation(simulator.moving[0][0], place, rotation, physicsClientId=world)
    pybullet.resetBaseVelocity(simulator.moving[0][0], (0.0,) * 3, (0.0,) * 3, physicsClientId=world)


def judged(lowest: float, tilt: float, x: float = 0.0) -> tuple[bool, bool]:
    """Return success and failure one control step after a cup in the air was let go."""
    episodes = start(MIDDLE, fork(MIDDLE, 0.0))
    put_cup(episodes.simulator, lowest, tilt, x)
    episodes.control(SLOT, np.zeros((1, 3)))
    return bool(episodes.simulator.success[0]), bool(episodes.simulator.failure[0])


def corners_of_boxes(boxes: Any) -> Floats:
    """Return the corners (b, K, 8, 3) of tools' boxes."""
    signs = np.array(list(product((-1.0, 1.0), repeat=3)))
    local = boxes.half_extents[:, :, None] * signs
    turn = bullet.rotation_matrices(boxes.rotations)
    corners: Floats = boxes.centres[:, :, None] + local @ turn.swapaxes(-1, -2)
    return corners


def all_corners() -> Floats:
    """Return the (32, 5) corners of the design space, normalised."""
    return np.array(list(product((-1.0, 1.0), repeat=5)))


def test_a_level_fork_by_hand() -> None:
    boxes = lift.fork_boxes(np.array([[0.1, 0.0, 0.01, 0.2, 0.04]]))
    np.testing.assert_allclose(boxes.half_extents[0, 1:], [[0.06, 0.01, 0.01]] + 2 * [[0.005, 0.1, 0.02]])
    # Handle 0.1 long, cross bar 0.02 thick behind it, prongs behind the bar, their inner faces 0.1 apart.
    np.testing.assert_allclose(
        boxes.centres[0], [[0, 0.05, 0], [0, 0.11, 0], [-0.055, 0.22, 0], [0.055, 0.22, 0]], atol=1e-12
    )
    np.testing.assert_allclose(lift.lowest_points(np.array([[0.1, 0.0, 0.01, 0.2, 0.04]])), [-0.02])


def test_prongs_turn_about_their_rear_end_and_a_positive_tilt_raises_the_tips() -> None:
    tilt = np.deg2rad(30.0)
    (left,) = corners_of_boxes(lift.fork_boxes(np.array([[0.1, tilt, 0.01, 0.2, 0.04]])))[0, 2:3]
    rear, tip = left[left[:, 1].argsort()][:4].mean(axis=0), left[left[:, 1].argsort()][4:].mean(axis=0)
    np.testing.assert_allclose(rear, [-0.055, 0.12, 0.0], atol=1e-12)
    np.testing.assert_allclose(tip, [-0.055, 0.12 + 0.2 * np.cos(tilt), 0.1], atol=1e-12)


def test_the_lowest_point_is_the_lowest_corner_of_any_box() -> None:
    designs = load_task("lift_cup").design_space.from_unit(
        np.vstack([all_corners(), np.random.default_rng(0).uniform(-1.0, 1.0, size=(200, 5))])
    )
    corners = corners_of_boxes(lift.fork_boxes(designs))
    np.testing.assert_allclose(lift.lowest_points(designs), corners[..., 2].min(axis=(1, 2)), atol=1e-12)


def test_a_cup_has_its_size_with_a_rim_that_stands_out_and_rests_on_its_bottom_alone() -> None:
    cups = lift._Cups(np.array([0.1]), np.array([0.15]))
    low = (cups.centres - cups.half_extents)[0] + [0.0, 0.0, cups.centre_height[0]]
    high = (cups.centres + cups.half_extents)[0] + [0.0, 0.0, cups.centre_height[0]]
    np.testing.assert_allclose(high.max(axis=0), [0.05 + lift.RIM_WIDTH, 0.05 + lift.RIM_WIDTH, 0.15])
    below_rim = high[:, 2] < 0.15 - 0.5 * lift.RIM_THICKNESS
    np.testing.assert_allclose(high[below_rim].max(axis=0)[:2], 0.05)
    np.testing.assert_allclose(np.sort(low[:, 2])[:2], [0.0, lift.WALL_GAP], atol=1e-12)
    assert below_rim.sum() == 5, "a bottom and four walls"


def test_mass_centre_and_inertia_of_a_cup_are_those_of_its_boxes() -> None:
    cups = lift._Cups(np.array([0.08]), np.array([0.15]))
    half_extents, centres = cups.half_extents[0], cups.centres[0]
    masses = half_extents.prod(axis=1) / half_extents.prod(axis=1).sum() * lift.CUP_MASS
    # Two points along each axis, 1/sqrt(3) of the way out, have a box's second moments.
    points = centres[:, None] + half_extents[:, None] * np.array(list(product((-1, 1), repeat=3))) / np.sqrt(3.0)
    weights = np.repeat(masses / 8.0, 8)
    x, y, z = points.reshape(-1, 3).T
    np.testing.assert_allclose([weights @ x, weights @ y, weights @ z], 0.0, atol=1e-12)
    expected = [weights @ (y**2 + z**2), weights @ (x**2 + z**2), weights @ (x**2 + y**2)]
    np.testing.assert_allclose(cups.inertia[0], expected, rtol=1e-9)
    simulator: Any = start((0.08 / lift.CUP_UNIT, 0.15 / lift.CUP_UNIT), fork(MIDDLE, 0.0)).simulator
    seen = pybullet.getDynamicsInfo(simulator.moving[0][0], -1, physicsClientId=simulator.worlds[0])
    np.testing.assert_allclose(seen[2], expected, rtol=1e-5)


@pytest.mark.parametrize("cup", list(product(lift.CUP_WIDTHS, lift.CUP_HEIGHTS)))
def test_no_tool_starts_on_the_table_or_at_a_cup(cup: tuple[float, float]) -> None:
    task, slots = load_task("lift_cup"), np.arange(8)
    episodes = Episodes(task, len(slots))
    simulator: Any = episodes.simulator
    rim = lift.CUP_START_Y - 0.5 * lift.CUP_UNIT * cup[0] - lift.RIM_WIDTH
    for designs in np.split(all_corners(), 4):
        episodes.begin(slots, np.tile(cup, (len(slots), 1)))
        episodes.design(slots, designs)
        corners = corners_of_boxes(lift.fork_boxes(task.design_space.from_unit(designs)))
        corners += simulator.pose[:, None, None]
        lowest, raised = corners[..., 2].min(axis=(1, 2)), simulator.pose[:, 2] > lift.TOOL_START[2]
        assert corners[..., 1].max() < rim - 0.01
        assert lowest.min() > lift.TOOL_CLEARANCE - 1e-12
        np.testing.assert_allclose(lowest[raised], lift.TOOL_CLEARANCE, atol=1e-12)
        assert simulator.inspect(0).overlap == 0.0


@pytest.mark.parametrize("cup", [SMALL, MIDDLE, WIDE])
def test_prongs_under_the_rim_lift_a_cup_and_others_do_not(cup: tuple[float, float]) -> None:
    fits = play(cup, fork(cup, 0.5 * lift.RIM_WIDTH))
    assert fits.success
    assert fits.simulator.outcome[0] > lift.SUCCESS_HEIGHT
    assert sum(fits.reward) > lift.SUCCESS_REWARD + lift.LIFT_WEIGHT * lift.SUCCESS_HEIGHT
    assert not play(cup, fork(cup, -0.005)).success, "too close together for the walls"
    if cup != WIDE:  # No fork is too wide for the widest cup.
        assert not play(cup, fork(cup, lift.RIM_WIDTH + 0.005)).success, "too wide for the rim"


def test_the_fork_for_one_width_lifts_no_cup_that_is_two_rims_wider_or_narrower() -> None:
    beyond = (2.0 * lift.RIM_WIDTH + 0.001) / lift.CUP_UNIT
    for other in (MIDDLE[0] - beyond, MIDDLE[0] + beyond):
        for clearance in (0.0, 0.5 * lift.RIM_WIDTH, lift.RIM_WIDTH):
            outcome = play((other, MIDDLE[1]), fork(MIDDLE, clearance))
            assert not outcome.success


@pytest.mark.parametrize("changes", [{"prong_length": 0.04}, {"prong_tilt": -0.5}])
def test_short_prongs_and_hanging_prongs_do_not_hold_a_wide_cup(changes: dict[str, float]) -> None:
    assert not play(WIDE, fork(WIDE, 0.5 * lift.RIM_WIDTH, **changes)).success


def test_a_cup_counts_as_lifted_by_its_lowest_corner_and_only_upright() -> None:
    above, below = lift.SUCCESS_HEIGHT + 0.02, lift.SUCCESS_HEIGHT - 0.01
    upright, tipped = np.arccos(lift.UPRIGHT), np.arccos(lift.TIPPED)
    assert judged(above, 0.0) == (True, False)
    assert judged(below, 0.0) == (False, False)
    assert judged(above, 0.9 * upright) == (True, False)
    assert judged(below, 0.9 * upright) == (False, False), "though its centre is higher than an upright cup's"
    assert judged(above, 1.1 * upright) == (False, False)
    assert judged(above, 1.1 * tipped) == (False, True)
    assert judged(above, np.pi) == (False, True), "upside down"


def test_a_cup_that_leaves_the_table_is_lost() -> None:
    assert judged(-0.3, 0.0, x=lift.TABLE_TOP[0][1] + 0.3) == (False, True)
    assert judged(0.01, 0.0, x=lift.TABLE_TOP[0][1] - 0.1) == (False, False)


def test_the_first_reward_by_hand() -> None:
    episodes = start(MIDDLE, fork(MIDDLE, 0.5 * lift.RIM_WIDTH))
    reward = episodes.control(SLOT, np.zeros((1, 3)))[0][0]
    # Cup 0.09 wide and 0.144 high; prongs end at y = 1.2 + 0.12 + 0.2, their top edge is at z = 0.05 + 0.02. The points
    # are 0.0225 before and behind y = 1.65, at z = 0.144 - 0.008; sideways nothing is missing.
    near, far = np.hypot(1.6275 - 1.52, 0.136 - 0.07), np.hypot(1.6725 - 1.52, 0.136 - 0.07)
    potential = 0.5 * (np.exp(-near / 0.03) + np.exp(-far / 0.03)) - 4.0 * 0.5 * (near + far)
    assert reward == pytest.approx(potential + 1.0 - 0.001, abs=1e-3)  # The cup settles by micrometres.


def test_sideways_misfit_is_paid_beyond_the_play() -> None:
    exact = fork(MIDDLE, 0.5 * lift.RIM_WIDTH)
    within = fork(MIDDLE, 0.5 * lift.RIM_WIDTH + 0.9 * lift.PLAY)
    beyond = fork(MIDDLE, 0.5 * lift.RIM_WIDTH + lift.PLAY + 0.03)
    first, second, third = (
        start(MIDDLE, design).control(SLOT, np.zeros((1, 3)))[0][0] for design in (exact, within, beyond)
    )
    assert first == pytest.approx(second, abs=1e-5)
    assert third < first - 0.01


def test_rewards_add_up_to_the_potential_reached() -> None:
    for clearance in (0.5 * lift.RIM_WIDTH, -0.01):
        outcome = play(MIDDLE, fork(MIDDLE, clearance))
        reached = outcome.simulator.potential[0] - lift.START_POTENTIAL
        expected = reached + lift.SLACK_REWARD * len(outcome.reward) + 10.0 * outcome.success
        assert sum(outcome.reward) == pytest.approx(expected, abs=1e-9)
        assert sum(outcome.reward) < 16.0


def test_an_idle_tool_leaves_the_cup_where_it_is() -> None:
    episodes = start(WIDE, fork(WIDE, 0.0))
    for _ in range(30):
        episodes.control(SLOT, np.zeros((1, 3)))
    simulator: Any = episodes.simulator
    np.testing.assert_allclose(simulator.bodies[0, 0, :3], simulator.cup_start[0], atol=1e-4)
    np.testing.assert_allclose(simulator.pose[0], lift.TOOL_START, atol=1e-4)


def test_moves_have_the_stated_length_and_end_at_the_workspace() -> None:
    episodes = start(SMALL, fork(SMALL, 0.0))
    simulator: Any = episodes.simulator
    before = simulator.pose[0].copy()
    episodes.control(SLOT, np.array([[-1.0, -1.0, 1.0]]))
    assert np.linalg.norm(simulator.pose[0] - before) == pytest.approx(lift.MAX_MOVE, rel=0.02)
    before = simulator.pose[0].copy()
    episodes.control(SLOT, np.array([[0.0, 0.0, 0.5]]))
    np.testing.assert_allclose(simulator.pose[0] - before, [0.0, 0.0, 0.5 * lift.MAX_MOVE], atol=3e-4)
    for _ in range(20):
        episodes.control(SLOT, np.array([[-1.0, -1.0, -1.0]]))
    lowest = lift.TOOL_CLEARANCE - lift.lowest_points(simulator.designs)[0]
    np.testing.assert_allclose(simulator.pose[0], [*lift.WORKSPACE.low[:2], lowest], atol=1e-4)


def test_the_observation_tells_what_the_tool_lacks_to_fit() -> None:
    episodes = start(MIDDLE, fork(MIDDLE, 0.008))
    state = dict(zip(load_task("lift_cup").state_space.names, episodes.simulator.state[0].tolist(), strict=True))
    assert state["left_clearance"] == pytest.approx(0.008, abs=1e-6)
    assert state["right_clearance"] == pytest.approx(0.008, abs=1e-6)
    assert state["prongs_to_rim_z"] == pytest.approx(0.136 - 0.07, abs=1e-6)
    assert state["prongs_to_cup_y"] == pytest.approx(1.65 - 1.42, abs=1e-6)
    assert state["cup_z_axis_z"] == 1.0
