"""Bounce against its documentation: strips, starts, what counts as through the hoop, reward, how an episode ends.

Nothing here depends on a tuned number: all of them are read from the task's module. Lengths are in m, times in s.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
import pytest

from codesign_bench.registry import load_module
from codesign_bench.task import Floats, load_task
from codesign_bench.task.episodes import Episodes

pytestmark = pytest.mark.numeric

bounce: Any = load_module("tasks", "bounce")
TASK = load_task("bounce")
SLOT = np.array([0])
IDLE = np.zeros((1, 1))
BALLS = range(bounce.NUM_BALLS)


@dataclass
class Outcome:
    """One episode: rewards, balls through the hoop and bodies after every step, and how it ended."""

    reward: list[float] = field(default_factory=list)
    through: list[float] = field(default_factory=list)
    places: list[Floats] = field(default_factory=list)
    terminated: bool = False
    success: bool = False


def instance_with(hoop: tuple[float, float], height: float = 4.5) -> Floats:
    """Return the instance (1, 9) with this hoop and balls that fall from `height`, exactly in their columns."""
    return np.array([[*hoop, *[0.0] * (1 + bounce.NUM_BALLS), *[height] * bounce.NUM_BALLS]])


def design_with(**values: float) -> Floats:
    """Return the normalised design (1, 5) with these values, and else a level strip of the longest sides."""
    longest = bounce.SIDE_LENGTH[1]
    given = {"tilt": 0.0, "bend": 0.0, "curl": 0.0, "left_length": longest, "right_length": longest, **values}
    return TASK.design_space.to_unit(np.array([list(given.values())]))


def play(instance: Floats, design: Floats, control: Floats = IDLE) -> Outcome:
    """Play one episode with the same control in every step."""
    episodes, outcome = Episodes(TASK, 1), Outcome()
    simulator: Any = episodes.simulator
    episodes.begin(SLOT, instance)
    episodes.design(SLOT, design)
    while True:
        reward, terminated, truncated = episodes.control(SLOT, control)
        outcome.reward.append(float(reward[0]))
        outcome.through.append(float(simulator.outcome[0]))
        outcome.places.append(simulator.bodies[0].copy())
        if terminated[0] or truncated[0]:
            outcome.terminated, outcome.success = bool(terminated[0]), bool(episodes.success(SLOT)[0])
            return outcome


def test_a_tilted_strip_is_straight_and_has_its_lengths_on_both_sides_of_the_hand() -> None:
    points = bounce.bent_strip(np.array([[0.3, 0.0, 0.0, 0.7, 1.4]]))[0]
    direction = np.array([np.cos(0.3), np.sin(0.3)])
    np.testing.assert_allclose(points[[0, -1]], [-0.7 * direction, 1.4 * direction], atol=1e-12)
    np.testing.assert_allclose(points @ [-direction[1], direction[0]], 0.0, atol=1e-12)


def test_bend_lifts_both_ends_or_neither_and_curl_one_of_them() -> None:
    dish, dome, wave = bounce.bent_strip(
        np.array([[0.0, 0.2, 0.0, 1.0, 1.0], [0.0, -0.2, 0.0, 1.0, 1.0], [0.0, 0.0, 0.2, 1.0, 1.0]])
    )
    assert dish[0, 1] == pytest.approx(dish[-1, 1])
    assert dish[0, 1] > 0.0
    np.testing.assert_allclose(dome[:, 1], -dish[:, 1], atol=1e-12)
    assert wave[-1, 1] == pytest.approx(-wave[0, 1])
    assert wave[-1, 1] > 0.0


def test_a_segment_has_the_heading_of_its_middle() -> None:
    tilt, bend, curl = 0.1, 0.2, -0.1
    steps = np.diff(bounce.bent_strip(np.array([[tilt, bend, curl, 1.2, 0.8]]))[0], axis=0)
    headings = np.arctan2(steps[:, 1], steps[:, 0])
    middles = np.arange(-6, 7, 2) / 7.0
    np.testing.assert_allclose(headings, tilt + bend * middles + curl * middles**2, atol=1e-12)


def test_no_strip_reaches_a_hoop_a_ball_or_the_height_below_which_balls_are_lost() -> None:
    inside = np.random.default_rng(7).uniform(-1.0, 1.0, size=(2_000, 5))
    designs = TASK.design_space.from_unit(np.vstack([list(product((-1.0, 1.0), repeat=5)), inside]))
    points, edge = bounce.bent_strip(designs), bounce.STRIP_HALF_WIDTH
    nearest = bounce.HOOP_DISTANCE[0] - bounce.HOOP_HALF_WIDTH
    assert np.abs(points[..., 0]).max() + bounce.RAIL <= nearest
    assert points[..., 1].max() + edge < bounce.DROP_HEIGHT[0] - bounce.BALL_RADIUS
    assert points[..., 1].min() - edge > bounce.LOST_HEIGHT
    assert bounce.HOOP_HEIGHT[0] > bounce.LOST_HEIGHT > bounce.FLOOR + bounce.BALL_RADIUS


@pytest.mark.parametrize(
    ("before", "after", "through"),
    [
        ((3.0, 1.0), (3.0, -1.0), True),  # straight down
        ((3.0, -1.0), (3.0, 1.0), False),  # upwards
        ((2.0, 1.0), (3.0, -1.0), True),  # at x = 2.5 when at the hoop's height
        ((2.0, 1.0), (2.6, -1.0), False),  # at x = 2.3
        ((3.0, 1.0), (3.0, 0.5), False),  # not there yet
    ],
)
def test_what_counts_as_through(before: tuple[float, float], after: tuple[float, float], through: bool) -> None:
    assert bounce.HOOP_HALF_WIDTH == 0.6
    found = bounce.comes_through(np.array([[before]]), np.array([[after]]), np.array([[[3.0, 0.0]]]))
    assert found.item() is through


def test_the_distance_from_a_way_is_that_of_its_nearest_point() -> None:
    before, hoop = np.array([[[0.0, 0.0]] * 3]), np.array([[[2.0, 1.0]]])
    after = np.array([[[4.0, 0.0], [1.0, 0.0], [0.0, 0.0]]])
    np.testing.assert_allclose(bounce.way_distance(before, after, hoop), [[1.0, 2.0**0.5, 5.0**0.5]])


def test_balls_start_in_their_columns_around_their_common_place() -> None:
    instance = np.array([[3.0, 0.0, 0.2, -0.1, 0.0, 0.1, 4.3, 4.5, 4.7]])
    expected = [[-0.9, 4.3], [0.2, 4.5], [1.3, 4.7]]
    assert bounce.COLUMNS == (-1.0, 0.0, 1.0)
    np.testing.assert_allclose(bounce.ball_starts(instance)[0], expected)


def test_hoops_are_left_and_right_equally_often_and_never_near() -> None:
    hoops = TASK.sample_instances(np.random.default_rng(0), 20_000)[:, bounce.HOOP]
    near, far = bounce.HOOP_DISTANCE
    distance = np.abs(hoops[:, 0])
    assert near <= distance.min() <= distance.max() <= far
    assert (hoops[:, 0] > 0.0).mean() == pytest.approx(0.5, abs=0.015)
    assert (distance < 0.5 * (near + far)).mean() == pytest.approx(0.5, abs=0.015)


@pytest.mark.parametrize("tilt", [0.0, 0.1, -0.2])
def test_balls_leave_a_straight_strip_as_a_mirror_with_loss_would_send_them(tilt: float) -> None:
    outcome = play(instance_with((4.0, -1.0)), design_with(tilt=tilt))
    for ball in BALLS:
        speeds = np.array([place[ball, 2:] for place in outcome.places])
        touched = int(np.argmax(speeds[:, 1] > 0.0))
        place, velocity = outcome.places[touched - 1][ball], speeds[touched]
        # Down to the touch gravity adds its work; there the speed across the strip turns round and shrinks.
        gap = bounce.BALL_RADIUS + bounce.STRIP_HALF_WIDTH
        level = np.tan(tilt) * place[0] + gap / np.cos(tilt)
        fall = np.sqrt(place[3] ** 2 + 2.0 * bounce.GRAVITY * (place[1] - level))
        along = -fall * np.sin(tilt)
        across = bounce.RESTITUTION * fall * np.cos(tilt)
        expected = np.array(
            [along * np.cos(tilt) - across * np.sin(tilt), along * np.sin(tilt) + across * np.cos(tilt)]
        )
        assert velocity[0] == pytest.approx(expected[0], abs=0.1)
        # Since the touch gravity has pulled for less than a control step.
        slowed = expected[1] - velocity[1]
        assert -0.1 <= slowed <= bounce.GRAVITY * bounce.CLOCK.control_period + 0.1


def test_the_scripts_strip_wins_and_its_mirror_image_misses() -> None:
    instance = instance_with((3.2, -0.3))
    episodes = Episodes(TASK, 1)
    episodes.begin(SLOT, instance)
    design = TASK.script().design(episodes.observation).astype(np.float64)
    won, lost = play(instance, design), play(instance, design * np.array([-1.0, 1.0, -1.0, 1.0, 1.0]))
    assert won.success
    assert won.terminated
    assert won.through[-1] == bounce.NUM_BALLS
    assert lost.through[-1] == 0.0
    assert not lost.success
    assert lost.terminated, "all balls are below the hoop for good"


def test_rewards_add_up_to_the_balls_through_and_the_nearest_they_came() -> None:
    hoop = (3.2, -0.3)
    instance = instance_with(hoop)
    outcome = play(instance, design_with(tilt=-0.12))
    ways = np.concatenate([bounce.ball_starts(instance), [place[: bounce.NUM_BALLS, :2] for place in outcome.places]])
    distances = bounce.way_distance(ways[:-1], ways[1:], np.array(hoop)[None, None])
    start = np.linalg.norm(ways[0] - hoop, axis=1)
    progress = ((start - distances.min(axis=0)) / start).mean()
    through = outcome.through[-1] / bounce.NUM_BALLS
    expected = progress + bounce.THROUGH_REWARD * through + bounce.SLACK_REWARD * len(outcome.reward)
    assert sum(outcome.reward) == pytest.approx(expected + bounce.SUCCESS_REWARD * outcome.success)


def test_the_hand_stays_on_its_rail_and_keeps_to_its_speed() -> None:
    outcome = play(instance_with((3.0, 0.0)), design_with(), np.ones((1, 1)))
    hand = np.array([0.0, *(place[bounce.TOOL_BODY, 0] for place in outcome.places)])
    assert hand.max() == pytest.approx(bounce.RAIL)
    steps = np.diff(hand)
    assert steps.max() == pytest.approx(bounce.MAX_SPEED * bounce.CLOCK.control_period)
    assert steps.min() >= -1e-9
