"""Catch balls against its documentation: throws, pans, what counts as held, how an episode ends.

Nothing here depends on a tuned number: all of them are read from the task's module. Lengths are in m, times in s.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import import_module
from itertools import product
from typing import Any

import numpy as np
import pymunk
import pytest

from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.registry import load_module
from codesign_bench.task import Floats, load_task
from codesign_bench.task.behaviours import GivenDesigns
from codesign_bench.task.episodes import Episodes

pytestmark = pytest.mark.numeric

catch: Any = load_module("tasks", "catch_balls")
script: Any = import_module("codesign_bench.tasks._scripts.catch_balls")
SLOT = np.array([0])
IDLE = np.zeros((1, 1))
PAN = np.array([script.CatchBallsScript.PAN])
RIGHT, LEFT = PAN, PAN * script.CatchBallsScript.MIRROR
"""The script's pans, normalised."""
HANGING = np.array([[1.0, 1.0, 1.0, 0.0, 0.0]])
"""The longest tool, straight down."""


@dataclass
class Outcome:
    """One episode: rewards, balls held after every step, and how it ended."""

    reward: list[float] = field(default_factory=list)
    held: list[float] = field(default_factory=list)
    terminated: bool = False
    success: bool = False


def throw(landing: float, offset: float = 0.8) -> Floats:
    """Return an instance (1, 10) whose balls come down around `landing`, as seen from the hand's start."""
    heights = [0.5 * (low + high) for low, high in catch.START_HEIGHTS]
    place = catch.HAND_START[0] + landing
    return np.array([[place, -offset, 0.0, offset, *heights, 0.0, 0.0, 0.0]])


def begin(instance: Floats, design: Floats) -> tuple[Episodes, Any]:
    """Return an episode after its design step, and its simulator."""
    episodes = Episodes(load_task("catch_balls"), 1)
    episodes.begin(SLOT, instance)
    episodes.design(SLOT, design)
    return episodes, episodes.simulator


def play(instance: Floats, design: Floats, control: Floats = IDLE) -> Outcome:
    """Play one episode with the same control in every step."""
    episodes, simulator = begin(instance, design)
    outcome = Outcome()
    while True:
        reward, terminated, truncated = episodes.control(SLOT, control)
        outcome.reward.append(float(reward[0]))
        outcome.held.append(float(simulator.outcome[0]))
        if terminated[0] or truncated[0]:
            outcome.terminated, outcome.success = bool(terminated[0]), bool(episodes.success(SLOT)[0])
            return outcome


def test_a_throw_by_hand() -> None:
    # From 8 m + 10 m the fall to the hand's height takes sqrt(2 * 8 / 8) = sqrt(2) s: at 2 m/s that is 2.83 m.
    instance = np.array([[23.0, 0.5, 0.0, 0.0, 18.0, 18.0, 18.0, 2.0, 0.0, -2.0]])
    assert (catch.GRAVITY, catch.HAND_START[1]) == (8.0, 10.0)
    starts, speeds = catch.throws(instance)
    np.testing.assert_allclose(starts[0, :, 0], [23.5 - 2.0 * 2.0**0.5, 23.0, 23.0 + 2.0 * 2.0**0.5])
    np.testing.assert_allclose(starts[0, :, 1], 18.0)
    np.testing.assert_allclose(speeds, [[[2.0, 0.0], [0.0, 0.0], [-2.0, 0.0]]])


def test_thrown_balls_reach_the_hands_height_where_the_instance_says() -> None:
    task = load_task("catch_balls")
    instances = task.sample_instances(np.random.default_rng(0), 16)
    slots = np.arange(len(instances))
    episodes = Episodes(task, len(instances))
    simulator: Any = episodes.simulator
    episodes.begin(slots, instances)
    episodes.design(slots, np.tile(HANGING, (len(slots), 1)))
    for space in simulator.spaces:
        space.remove(*tool_of(space).shapes)
    seen = np.full((len(slots), catch.NUM_BALLS), np.nan)
    for _ in range(60):
        before = simulator.bodies[:, : catch.NUM_BALLS].copy()
        simulator.step(slots, np.zeros((len(slots), 1)))
        after = simulator.bodies[:, : catch.NUM_BALLS]
        share = (before[..., 1] - catch.HAND_START[1]) / (before[..., 1] - after[..., 1])
        crossed = (share >= 0.0) & (share < 1.0)
        seen[crossed] = (before[..., 0] + share * (after[..., 0] - before[..., 0]))[crossed]
    np.testing.assert_allclose(seen, instances[:, catch.LANDING, None] + instances[:, catch.OFFSETS], atol=0.1)


def tool_of(space: pymunk.Space) -> pymunk.Body:
    """Return a scene's tool."""
    (tool,) = [body for body in space.bodies if body.body_type == pymunk.Body.KINEMATIC]
    return tool


def test_balls_never_meet_in_the_air() -> None:
    for (_, top), (bottom, _) in zip(catch.START_HEIGHTS, catch.START_HEIGHTS[1:], strict=False):
        assert bottom - top > 2.0 * catch.BALL_RADIUS


def test_no_tool_reaches_the_balls_starts_the_walls_or_a_pile_on_the_floor() -> None:
    space = load_task("catch_balls").design_space
    inside = np.random.default_rng(7).uniform(-1.0, 1.0, size=(2_000, space.size))
    designs = space.from_unit(np.vstack([list(product((-1.0, 1.0), repeat=space.size)), inside]))
    points = catch.chain_points(designs, catch.FIRST_LINK_ANGLE) + catch.HAND_START
    travel = catch.MAX_SPEED * load_task("catch_balls").horizon * catch.CLOCK.control_period
    edge, ball = catch.LINK_HALF_WIDTH, 2.0 * catch.BALL_RADIUS
    assert points[..., 1].max() + edge < catch.START_HEIGHTS[0][0] - catch.BALL_RADIUS
    assert points[..., 1].min() - edge > catch.FLOOR + catch.NUM_BALLS * ball
    assert points[..., 0].min() - edge - travel > catch.WALLS[0] + 2.0 * ball
    assert points[..., 0].max() + edge + travel < catch.WALLS[1] - 2.0 * ball


def test_positive_angles_make_a_pan_on_the_right() -> None:
    design = np.array([[1.0, 2.0, 2.0, np.pi / 3.0, np.pi / 3.0]])
    points = catch.chain_points(design, catch.FIRST_LINK_ANGLE)
    # Down, then 30 degrees below the horizontal to the right, then 30 degrees above it.
    root = 3.0**0.5
    np.testing.assert_allclose(points[0], [[0.0, 0.0], [0.0, -1.0], [root, -2.0], [2.0 * root, -1.0]], atol=1e-12)


@pytest.mark.parametrize(
    ("place", "velocity", "held"),
    [
        ((2.0, -1.0), (0.0, 0.0), True),  # on the pan
        ((2.0, -1.0), (1.0, 0.0), False),  # sliding over it
        ((2.0, -1.0), (0.0, -1.0), False),  # falling onto it
        ((2.0, -3.0), (0.0, 0.0), False),  # beneath it
        ((-2.0, -1.0), (0.0, 0.0), False),  # on the other side
        ((4.0, -0.5), (0.0, 0.0), False),  # beyond its tip
        ((0.1, 0.7), (0.0, 0.0), False),  # balancing on the hand
        ((2.0, 6.0), (0.0, 0.0), False),  # still in the sky
    ],
)
def test_what_counts_as_held(place: tuple[float, float], velocity: tuple[float, float], held: bool) -> None:
    points = np.array([[[0.0, 0.0], [0.0, -1.0], [3.0**0.5, -2.0], [2.0 * 3.0**0.5, -1.0]]])
    assert catch.is_held(points, np.array([[place]]), np.array([[velocity]])).item() is held


def test_the_pan_on_the_side_of_the_balls_catches_them_and_the_other_does_not() -> None:
    for landing, right, wrong in ((2.5, RIGHT, LEFT), (-2.5, LEFT, RIGHT)):
        caught, missed = play(throw(landing), right), play(throw(landing), wrong)
        assert caught.success
        assert caught.terminated
        assert caught.held[-1] == catch.NUM_BALLS
        assert not missed.success
        assert missed.terminated, "all balls are lost for good"
        assert missed.held[-1] == 0.0


def test_success_comes_when_the_last_ball_has_been_held_for_half_a_second() -> None:
    outcome = play(throw(2.5), RIGHT)
    assert all(held == catch.NUM_BALLS for held in outcome.held[-catch.HOLD_STEPS :])
    assert outcome.held[-catch.HOLD_STEPS - 1] < catch.NUM_BALLS


def test_an_episode_ends_once_one_ball_is_lost_and_the_others_are_caught() -> None:
    far = catch.LANDING_SPREAD + 2.5  # The outer balls come down left of the hand and right of the pan's middle.
    outcome = play(throw(1.0, offset=far), RIGHT)
    assert not outcome.success
    assert outcome.terminated
    assert 0 < outcome.held[-1] < catch.NUM_BALLS


@pytest.mark.parametrize("landing", [2.5, -2.5, 0.3])
def test_rewards_add_up_to_the_balls_held_at_the_end(landing: float) -> None:
    outcome = play(throw(landing, offset=1.0), RIGHT)
    expected = outcome.held[-1] / catch.NUM_BALLS + catch.SLACK_REWARD * len(outcome.reward)
    assert sum(outcome.reward) == pytest.approx(expected + catch.SUCCESS_REWARD * outcome.success)


def test_the_hand_keeps_to_its_speed_and_acceleration() -> None:
    episodes, simulator = begin(throw(4.0), RIGHT)
    period = catch.CLOCK.control_period
    velocity, place = [0.0], [simulator.bodies[0, catch.NUM_BALLS, 0]]
    for step in range(24):
        episodes.control(SLOT, np.array([[1.0 if step < 12 else -1.0]]))
        velocity.append(float(simulator.bodies[0, catch.NUM_BALLS, 2]))
        place.append(float(simulator.bodies[0, catch.NUM_BALLS, 0]))
    assert max(velocity) == pytest.approx(catch.MAX_SPEED)
    assert min(velocity) == pytest.approx(-catch.MAX_SPEED)
    assert np.abs(np.diff(velocity)).max() <= catch.MAX_ACCELERATION * period + 1e-9
    np.testing.assert_allclose(np.diff(place), period * np.array(velocity[1:]), atol=1e-9)
    assert np.ptp(simulator.bodies[0, catch.NUM_BALLS, 1]) == 0.0


def test_balls_come_down_left_and_right_of_the_hand_equally_often_and_never_near_it() -> None:
    instances = load_task("catch_balls").sample_instances(np.random.default_rng(0), 20_000)
    distance = np.abs(instances[:, catch.LANDING] - catch.HAND_START[0])
    near, far = catch.LANDING_DISTANCE
    assert near <= distance.min() <= distance.max() <= far
    assert (instances[:, catch.LANDING] > catch.HAND_START[0]).mean() == pytest.approx(0.5, abs=0.015)
    assert (distance < 0.5 * (near + far)).mean() == pytest.approx(0.5, abs=0.015)


def test_a_ball_on_top_of_others_is_not_held() -> None:
    points = np.array([[[0.0, 0.0], [0.0, -1.0], [3.0**0.5, -2.0], [2.0 * 3.0**0.5, -1.0]]])
    steep = (catch.LINK_HALF_WIDTH + catch.BALL_RADIUS) / np.cos(np.pi / 6.0)  # above a link, in a corner as well
    heights = {steep: True, steep + 2.0**0.5 * catch.BALL_RADIUS: False}
    for height, held in heights.items():
        assert catch.is_held(points, np.array([[[3.0**0.5, -2.0 + height]]]), np.zeros((1, 1, 2))).item() is held


def test_a_small_pan_needs_a_hand_that_moves() -> None:
    task = load_task("catch_balls")
    small, far = np.array([[-1.0, 0.6, 0.6, 1.0, 1.0]]), throw(3.8)
    assert not play(far, small).success
    assert evaluate(task, GivenDesigns(small[0], task.script()), instances=far).successes.all()


def test_a_smaller_pan_solves_nearly_as_much_with_more_effort() -> None:
    """Material and effort, the two sides of the trade-off, can be had for each other."""
    task = load_task("catch_balls")
    instances, tools = task.evaluation_instances()[:48], []
    for length in (1.0, 0.6):
        side = np.sign(instances[:, [catch.LANDING]] - catch.HAND_START[0])
        angles, ones = np.repeat(side, 2, axis=1), np.ones((len(instances), 1))
        tools.append(np.concatenate([-ones, length * ones, length * ones, angles], axis=1))
    large, small = (evaluate(task, GivenDesigns(tool, task.script()), instances=instances) for tool in tools)
    assert small.material.mean() < large.material.mean() - 0.05
    assert small.effort.mean() > large.effort.mean() + 0.05
    assert small.successes.mean() > large.successes.mean() - 0.1
