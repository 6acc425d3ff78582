"""Scoop against its documentation: geometry, piles, what counts as held, reward, and what a gentle hand may do.

Nothing here depends on a tuned number: all of them are read from the task's module. Lengths are in m, times in s.
"""

from __future__ import annotations

from itertools import product
from typing import Any, cast

import numpy as np
import pymunk
import pytest

from codesign_bench.registry import load_module
from codesign_bench.task import Floats, load_task
from codesign_bench.task.episodes import Episodes

pytestmark = pytest.mark.numeric

scoop: Any = load_module("tasks", "scoop")
SLOT = np.array([0])
IDLE = np.zeros((1, 3))
TRAY = np.array([[0.0, 1.0, 1.0, 1.0, -0.75]])
"""A ladle, normalised, whose second and third link make one long tray that rises by 3 degrees: less than balls need."""


def instance(wanted: int, pile: int = 0, shift: float = 0.0) -> Floats:
    """Return an instance (1, 3)."""
    return np.array([[wanted, pile, shift]], dtype=np.float64)


def started(instances: Floats, designs: Floats) -> Episodes:
    """Return episodes right after the design step; `designs` (b, D) are normalised."""
    slots = np.arange(len(instances))
    episodes = Episodes(load_task("scoop"), len(instances))
    episodes.begin(slots, instances)
    episodes.design(slots, designs)
    return episodes


def many_designs(count: int) -> Floats:
    """Return all corners of the design space and `count` designs inside, normalised."""
    space = load_task("scoop").design_space
    inside = np.random.default_rng(7).uniform(-1.0, 1.0, size=(count, space.size))
    return np.vstack([list(product((-1.0, 1.0), repeat=space.size)), inside])


def tray_at(height: float, wanted: int, balls: int) -> Episodes:
    """Return an episode whose tray's lowest point has been put at `height`, with so many balls at rest on it."""
    episodes = started(instance(wanted), TRAY)
    simulator: Any = episodes.simulator
    tool, chain = simulator.tools[0], simulator.chain[0]
    tool.position = (scoop.TOOL_START[0], height - chain[:, 1].min())
    simulator.bodies[0, scoop.NUM_BALLS, :2] = tool.position
    along = (chain[3] - chain[1]) / np.linalg.norm(chain[3] - chain[1])
    across = np.array([-along[1], along[0]]) * (scoop.BALL_RADIUS + scoop.LINK_HALF_WIDTH)
    for index, ball in enumerate(simulator.balls[0].bodies):
        if index < balls:
            ball.position = tuple(np.array(tool.position) + (1.0 + 1.3 * index) * along + across)
        else:  # The others make no difference: in two layers beside the reservoir.
            ball.position = (scoop.YARD[0] + 1.0, scoop.FLOOR + 1.0 + 1.3 * index)
    return episodes


def idle(episodes: Episodes, steps: int) -> list[bool]:
    """Leave the hand still for so many control steps; return whether each ended in success."""
    results = []
    for _ in range(steps):
        episodes.simulator.step(SLOT, IDLE)
        results.append(bool(episodes.success(SLOT)[0]))
    return results


def test_balls_above_a_ladle_by_hand() -> None:
    ladle = np.array([[[-1.0, 2.0], [0.0, 0.0], [2.0, 0.0], [3.0, 1.0]]])
    places = {
        (1.0, 0.7): True,  # on the bottom
        (1.0, 9.0): True,  # far above it
        (1.0, -0.7): False,  # below it
        (2.5, 0.7): True,  # on the rising link, which is at 0.5 there
        (2.5, 0.3): False,  # below the rising link
        (-0.5, 1.5): True,  # on the handle, which is at 1 there
        (-0.5, 0.5): False,  # below the handle
        (3.1, 5.0): False,  # beyond the tip
        (-1.1, 5.0): False,  # beyond the held end
    }
    answers = scoop.above(np.array([list(places)]), ladle)
    assert answers[0].tolist() == list(places.values())


def test_distances_from_a_chain_by_hand() -> None:
    chain = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [4.0, 2.0]])
    places = np.array([[1.0, 0.5], [-3.0, 4.0], [2.5, 1.0], [7.0, 6.0]])
    np.testing.assert_allclose(scoop.distances(places, chain), [0.5, 5.0, 0.5, 5.0])


def test_turning_points_by_hand() -> None:
    points = np.array([[[1.0, 0.0], [0.0, 2.0]]])
    np.testing.assert_allclose(scoop.rotated(points, np.array([0.5 * np.pi])), [[[0.0, 1.0], [-2.0, 0.0]]], atol=1e-12)


def profile_by_hand(balls: Floats, middle: float) -> tuple[list[float], list[float]]:
    """Return what `profile` should say of the balls (N, 4) of one slot, place by place and ball by ball."""
    surface, rise = [], []
    for x in middle + scoop.PROFILE_X:
        reached = [
            (float(y + np.sqrt(scoop.BALL_RADIUS**2 - (x - ball_x) ** 2)), float(speed))
            for ball_x, y, _, speed in balls
            if abs(x - ball_x) < scoop.BALL_RADIUS
        ]
        height, speed = max(reached, default=(scoop.FLOOR, 0.0))
        surface.append(height)
        rise.append(speed)
    return surface, rise


def test_the_profile_of_two_balls_by_hand() -> None:
    radius, far = scoop.BALL_RADIUS, 1e3
    balls = np.zeros((1, scoop.NUM_BALLS, 4))
    balls[0, :, :2] = far, far  # Out of sight; nothing of them may show at the ends.
    balls[0, 0] = scoop.PROFILE_X[4] - 0.2 * radius, 11.0, 3.0, -0.5  # Over the places 3 and 4.
    balls[0, 1] = scoop.PROFILE_X[4] + 0.4 * radius, 10.7, 3.0, 0.25  # Over the places 4 and 5, and lower.
    surface, rise = scoop.profile(balls, np.zeros(1))
    reached = {3: 11.0 + 0.6 * radius, 4: 11.0 + np.sqrt(0.96) * radius, 5: 10.7 + 0.8 * radius}
    assert surface[0] == pytest.approx([reached.get(place, scoop.FLOOR) for place in range(scoop.PROFILE_POINTS)])
    assert rise[0] == pytest.approx(
        [{3: -0.5, 4: -0.5, 5: 0.25}.get(place, 0.0) for place in range(scoop.PROFILE_POINTS)]
    )


def test_the_state_shows_the_pile_before_there_is_a_tool_and_balls_in_motion_after() -> None:
    episodes, slots = Episodes(load_task("scoop"), 3), np.arange(3)
    episodes.begin(slots, np.vstack([instance(2), instance(4, pile=7, shift=-0.4), instance(7, pile=19, shift=0.3)]))
    seen, simulator = load_task("scoop").layout.split(episodes.observation), cast("Any", episodes.simulator)
    rng = np.random.default_rng(4)
    for phase in ("design", "control", "control"):
        for slot in slots:
            balls, middle = simulator.bodies[slot, : scoop.NUM_BALLS], simulator.bodies[slot, scoop.NUM_BALLS, 0]
            surface, rise = profile_by_hand(balls, middle)
            np.testing.assert_allclose(seen.state[slot, scoop.SURFACE], surface, atol=1e-5)
            np.testing.assert_allclose(seen.state[slot, scoop.RISE], rise, atol=1e-5)
            if phase == "design":
                pile = scoop.settled_piles()[(0, 7, 19)[slot]]
                assert np.array_equal(balls[:, :2], pile)
                assert max(surface) == pytest.approx(pile[:, 1].max() + scoop.BALL_RADIUS, abs=0.4 * scoop.BALL_RADIUS)
                assert not any(rise)
        if phase == "design":
            episodes.design(slots, rng.uniform(-1.0, 1.0, size=(3, 5)))
        for _ in range(3):
            episodes.control(slots, rng.uniform(-1.0, 1.0, size=(3, 3)))
    assert np.abs(seen.state[:, scoop.RISE]).max() > 0.0


def test_the_profile_does_not_depend_on_the_balls_order_and_moves_with_the_tool() -> None:
    balls = np.zeros((1, scoop.NUM_BALLS, 4))
    balls[0, :, :2] = scoop.settled_piles()[5]
    balls[..., 3] = np.arange(scoop.NUM_BALLS)
    middle = scoop.TOOL_START[:1]
    before = scoop.profile(balls, middle)
    np.testing.assert_array_equal(scoop.profile(balls[:, ::-1], middle), before)
    np.testing.assert_allclose(scoop.profile(balls + np.array([2.0, 0.0, 0.0, 0.0]), middle + 2.0), before, atol=1e-9)


def test_the_profile_reaches_over_every_tool() -> None:
    space = load_task("scoop").design_space
    points = scoop.chain_points(space.from_unit(many_designs(200)), scoop.FIRST_LINK_ANGLE)
    x = (points - points[:, 1:2])[..., 0]
    assert scoop.PROFILE_X[0] <= x.min()
    assert x.max() <= scoop.PROFILE_X[-1]


def test_balls_thrown_anywhere_leave_the_observation_in_its_bounds() -> None:
    episodes = started(instance(3), TRAY)
    simulator: Any = episodes.simulator
    low, high = load_task("scoop").state_space.bounds
    for place, velocity in (((15.0, 500.0), (0.0, 300.0)), ((15.0, 9.5), (0.0, -300.0)), ((15.0, -80.0), (90.0, 0.0))):
        for ball in simulator.balls[0].bodies:
            ball.position, ball.velocity = place, velocity
        episodes.control(SLOT, IDLE)
        state = load_task("scoop").layout.split(episodes.observation).state[0]
        assert np.isfinite(state).all()
        assert ((low - 1e-4 <= state) & (state <= high + 1e-4)).all()


def test_piles_are_different_nearly_at_rest_and_inside_the_reservoir() -> None:
    piles = scoop.settled_piles()
    assert piles.shape == (scoop.NUM_PILES, scoop.NUM_BALLS, 2)
    assert len(np.unique(piles.reshape(scoop.NUM_PILES, -1), axis=0)) == scoop.NUM_PILES
    left, right = scoop.RESERVOIR
    assert piles[..., 0].min() >= left + scoop.BALL_RADIUS - 1e-6
    assert piles[..., 0].max() <= right - scoop.BALL_RADIUS + 1e-6
    assert piles[..., 1].min() >= scoop.FLOOR + scoop.BALL_RADIUS - 1e-6
    assert piles[..., 1].max() <= scoop.RIM
    for pile in piles[:4]:
        apart = np.linalg.norm(pile[:, None] - pile, axis=2)[np.triu_indices(scoop.NUM_BALLS, 1)]
        assert apart.min() >= 2.0 * scoop.BALL_RADIUS - 1e-6
        space, balls = scoop.empty_reservoir(), scoop.Balls.new()
        balls.move(None, space, pile)
        for _ in range(30):  # One second.
            space.step(scoop.CLOCK.period)
        moved = np.linalg.norm([body.position for body in balls.bodies] - pile, axis=1)
        assert np.median(moved) < 0.5 * scoop.BALL_RADIUS  # They slump a little: see `settled_piles`.


def test_no_tool_starts_in_a_ball_and_no_ball_in_another() -> None:
    designs, rng = many_designs(64), np.random.default_rng(1)
    instances = load_task("scoop").sample_instances(rng, len(designs))
    instances[:, scoop.SHIFT] = scoop.START_SHIFT * rng.choice([-1.0, 1.0], size=len(designs))
    simulator: Any = started(instances, designs).simulator
    left, right = scoop.RESERVOIR
    for slot in range(len(designs)):
        balls, joint = simulator.bodies[slot, : scoop.NUM_BALLS, :2], simulator.bodies[slot, scoop.NUM_BALLS, :2]
        tool = simulator.chain[slot] + joint
        assert scoop.distances(balls, tool).min() > scoop.BALL_RADIUS + scoop.LINK_HALF_WIDTH
        apart = np.linalg.norm(balls[:, None] - balls, axis=2)[np.triu_indices(scoop.NUM_BALLS, 1)]
        assert apart.min() >= 2.0 * scoop.BALL_RADIUS - 1e-6
        assert left + scoop.BALL_RADIUS <= balls[:, 0].min() + 1e-6
        assert balls[:, 0].max() <= right - scoop.BALL_RADIUS + 1e-6
        assert balls[:, 1].max() < scoop.LINE
        assert tool[:, 1].min() == pytest.approx(scoop.TOOL_START[1])
        assert joint[0] == pytest.approx(scoop.TOOL_START[0] + instances[slot, scoop.SHIFT])
        assert left + scoop.CLEARANCE - 1e-6 <= tool[:, 0].min()
        assert tool[:, 0].max() <= right - scoop.CLEARANCE + 1e-6


def test_the_hand_gains_speed_gently() -> None:
    episodes = started(instance(3), TRAY)
    simulator: Any = episodes.simulator
    gain = scoop.MAX_ACCELERATION * load_task("scoop").control_period
    for step in range(1, 6):
        simulator.step(SLOT, np.array([[0.0, 1.0, 0.0]]))
        np.testing.assert_allclose(simulator.hand_velocity, [[0.0, min(step * gain, scoop.MAX_SPEED)]])
    simulator.step(SLOT, np.array([[1.0, 1.0, 0.0]]))
    np.testing.assert_allclose(simulator.hand_velocity, [[gain, scoop.MAX_SPEED]])


def test_tools_stay_in_their_place_whatever_is_asked() -> None:
    designs, rng = many_designs(16), np.random.default_rng(2)
    simulator: Any = started(load_task("scoop").sample_instances(rng, len(designs)), designs).simulator
    left, right = scoop.RESERVOIR
    for step in range(12):
        if step % 4 == 0:
            controls = rng.choice([-1.0, 1.0], size=(len(designs), 3))
        simulator.step(np.arange(len(designs)), controls)
        assert np.abs(simulator.hand_velocity).max() <= scoop.MAX_SPEED + 1e-6
        points = scoop.rotated(simulator.chain, simulator.tilt) + simulator.bodies[:, None, scoop.NUM_BALLS, :2]
        assert np.abs(simulator.tilt).max() <= 1.2 * scoop.MAX_TILT
        assert points[..., 1].min() >= scoop.FLOOR + 0.5 * scoop.CLEARANCE
        assert left + 0.5 * scoop.CLEARANCE <= points[..., 0].min()
        assert points[..., 0].max() <= right - 0.5 * scoop.CLEARANCE


def test_the_bodies_are_read_in_their_order() -> None:
    episodes = started(instance(3), TRAY)
    simulator: Any = episodes.simulator
    simulator.step(SLOT, np.array([[0.3, 1.0, 0.2]]))
    bodies = [*simulator.balls[0].bodies, simulator.tools[0]]
    np.testing.assert_array_equal(simulator.bodies[0, :, :2], [body.position for body in bodies])
    np.testing.assert_array_equal(simulator.bodies[0, :, 2:], [body.velocity for body in bodies])


@pytest.mark.parametrize("wanted", [1, 3, 5])
def test_the_wanted_number_at_rest_on_a_clear_tool_succeeds(wanted: int) -> None:
    results = idle(tray_at(scoop.CLEAR + 0.2, wanted, balls=wanted), scoop.HELD_STEPS)
    assert results == [False] * (scoop.HELD_STEPS - 1) + [True]


@pytest.mark.parametrize("balls", [0, 2, 4])
def test_another_number_does_not_succeed(balls: int) -> None:
    episodes = tray_at(scoop.CLEAR + 0.2, wanted=3, balls=balls)
    assert not any(idle(episodes, 2 * scoop.HELD_STEPS))
    assert episodes.simulator.outcome[0] == balls


def test_a_tool_that_is_not_clear_holds_nothing() -> None:
    episodes = tray_at(scoop.CLEAR - 0.2, wanted=3, balls=3)
    assert not any(idle(episodes, 2 * scoop.HELD_STEPS))
    assert episodes.simulator.outcome[0] == 0.0


def test_a_ball_in_motion_is_not_held_until_it_rests() -> None:
    episodes = tray_at(scoop.CLEAR + 0.2, wanted=3, balls=3)
    simulator: Any = episodes.simulator
    last = simulator.balls[0].bodies[2]
    last.position = (last.position.x, last.position.y + 1.0)  # It falls for about 0.45 s.
    results = idle(episodes, 4 * scoop.HELD_STEPS)
    assert not any(results[: scoop.HELD_STEPS])
    assert any(results)


def test_balls_rest_on_a_gentle_slope_and_slide_off_a_steep_one() -> None:
    steepest = np.arctan(scoop.BALL_FRICTION * scoop.TOOL_FRICTION)
    assert steepest > scoop.MAX_TILT, "tilting alone moves no ball on a level link"
    for slope, stays in ((0.5 * steepest, True), (2.0 * steepest, False)):
        space, balls = scoop.empty_reservoir(), scoop.Balls.new()
        ramp = pymunk.Segment(space.static_body, (12.0, 16.0), (22.0, 16.0 + 10.0 * np.tan(slope)), 0.1)
        ramp.friction = scoop.TOOL_FRICTION
        space.add(ramp)
        start = np.array([17.0, 16.0 + 5.0 * np.tan(slope)]) + 0.7 * np.array([-np.sin(slope), np.cos(slope)])
        places = np.tile(start, (scoop.NUM_BALLS, 1))
        places[1:] = (scoop.YARD[0] + 1.0, scoop.FLOOR + 1.0) + np.arange(1, scoop.NUM_BALLS)[:, None] * (0.0, 1.3)
        balls.move(None, space, places)
        for _ in range(30):  # One second.
            space.step(scoop.CLOCK.period)
        moved = np.linalg.norm(balls.bodies[0].position - start)
        assert (moved < 0.1) == stays
        if not stays:  # g (sin - mu cos) t^2 / 2, a little less for the damping.
            free = 0.5 * scoop.GRAVITY * (np.sin(slope) - np.tan(steepest) * np.cos(slope))
            assert 0.7 * free < moved < 1.05 * free


def test_an_idle_tool_lifts_nothing_and_loses_nothing() -> None:
    episodes = started(instance(3), TRAY)
    rewards = []
    for _ in range(load_task("scoop").horizon):
        reward, _, truncated = episodes.control(SLOT, IDLE)
        rewards.append(float(reward[0]))
    assert truncated[0]
    assert not episodes.success(SLOT)[0]
    assert episodes.simulator.outcome[0] == 0.0
    assert sum(rewards) == pytest.approx(len(rewards) * scoop.SLACK_REWARD, abs=0.02)
    simulator: Any = episodes.simulator
    balls = simulator.bodies[0, : scoop.NUM_BALLS]
    assert balls[:, 1].max() < scoop.RIM
    assert np.linalg.norm(balls[:, 2:], axis=1).max() < scoop.REST_SPEED


@pytest.mark.parametrize("wanted", [1, 5])
def test_rewards_add_up_to_the_progress_made(wanted: int) -> None:
    task = load_task("scoop")
    tool = task.script().design(np.full((1, task.layout.size), wanted, np.float32))
    episodes = started(instance(wanted), tool.astype(np.float64))
    simulator: Any = episodes.simulator
    total, steps, ended = 0.0, 0, False
    while not ended:
        act = task.script().act(episodes.observation)
        reward, terminated, truncated = episodes.control(SLOT, act.astype(np.float64))
        total, steps, ended = total + float(reward[0]), steps + 1, bool(terminated[0] or truncated[0])
    held, lowest = simulator.outcome[0], simulator.lowest[0]
    lift = min(1.0, (lowest - scoop.TOOL_START[1]) / (scoop.CEILING - scoop.TOOL_START[1]))
    number = ((1.0 + min(held, wanted)) / (1.0 + max(held, wanted))) ** scoop.NUMBER_EXPONENT
    success = scoop.SUCCESS_REWARD * bool(episodes.success(SLOT)[0])
    assert held > 0.0
    assert total == pytest.approx(lift * number + steps * scoop.SLACK_REWARD + success, abs=1e-6)
