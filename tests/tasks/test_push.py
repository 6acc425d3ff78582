"""Push against its documentation: geometry, friction, success, reward, and a physics step that is small enough.

Nothing here depends on a tuned number: all of them are read from the task's module. Lengths are in m, times in s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise, product
from typing import Any

import numpy as np
import pymunk
import pytest

from codesign_bench.registry import load_module
from codesign_bench.task import Floats, load_task
from codesign_bench.task.episodes import Episodes

pytestmark = pytest.mark.numeric

push: Any = load_module("tasks", "push")
REACH = push.PUCK_RADIUS + push.LINK_HALF_WIDTH
"""Distance of a link's core from the puck's centre when they touch."""
SLOT = np.array([0])
STRAIGHT = np.array([[-0.25, -0.25, -0.25, 0.0, 0.0]])
"""A straight tool, normalised: short enough to go behind the puck, long enough to push it to far goals on the left."""
IDLE = np.zeros((1, 2))


@dataclass
class Outcome:
    """One episode: rewards, distances from puck to goal before and after every step, and how it ended."""

    reward: list[float] = field(default_factory=list)
    puck: list[Floats] = field(default_factory=list)
    terminated: bool = False
    success: bool = False


def goal_at(distance: float, angle: float) -> Floats:
    """Return the instance (1, 2) whose goal lies `distance` from the puck's start in the direction `angle`."""
    return push.PUCK_START + distance * np.array([[np.cos(angle), np.sin(angle)]])


def play(goal: Floats, controller: Callable[[Floats], Floats], prepare: Callable[[pymunk.Space], None]) -> Outcome:
    """Play one episode with the straight tool.

    `controller` maps an observation (O,) to a control (1, 2); `prepare` may change the scene after the design step.
    """
    episodes, outcome = Episodes(load_task("push"), 1), Outcome()
    simulator: Any = episodes.simulator
    episodes.begin(SLOT, goal)
    episodes.design(SLOT, STRAIGHT)
    prepare(simulator.spaces[0])
    outcome.puck.append(push.PUCK_START.copy())
    while True:
        reward, terminated, truncated = episodes.control(SLOT, controller(episodes.observation[0].astype(float)))
        outcome.reward.append(float(reward[0]))
        outcome.puck.append(simulator.bodies[0, 0, :2].copy())
        if terminated[0] or truncated[0]:
            outcome.terminated, outcome.success = bool(terminated[0]), bool(episodes.success(SLOT)[0])
            return outcome


def as_built(space: pymunk.Space) -> None:
    """Leave a scene as it is."""


def slide(speed: float, angle: float) -> Callable[[pymunk.Space], None]:
    """Return a function that takes the tool off the table and gives the puck a velocity."""

    def prepare(space: pymunk.Space) -> None:
        space.remove(*links_of(space))
        (puck,) = [body for body in space.bodies if body.body_type == pymunk.Body.DYNAMIC]
        puck.velocity = (speed * np.cos(angle), speed * np.sin(angle))

    return prepare


def links_of(space: pymunk.Space) -> list[pymunk.Segment]:
    """Return the shapes of a scene's tool."""
    return [shape for shape in space.shapes if isinstance(shape, pymunk.Segment)]


def stay(observation: Floats) -> Floats:
    """Hold the tool still."""
    return IDLE


def push_left(observation: Floats) -> Floats:
    """Bring the tip of a straight tool to the right of the puck, push left, and stop near the goal."""
    task = load_task("push")
    state = task.layout.split(observation).state
    puck, base, to_goal = state[push.PUCK], state[push.BASE], state[push.PUCK_TO_GOAL]
    length = task.design_space.from_unit(STRAIGHT)[0, task.design_space.group("link_")].sum()
    behind = puck + np.array([REACH + length + 0.2, 0.0])
    aligned = abs(base[1] - puck[1]) < 0.05
    if not aligned:  # First to the right, where the tool is clear of the puck, then to the puck's height.
        way = behind - base
        way[1] *= abs(way[0]) < 0.1
        return np.clip(way, -0.2, 0.2)[None] / 0.2
    near = np.linalg.norm(to_goal) < 0.6 * push.GOAL_RADIUS
    return IDLE if near else np.array([[-0.5, 0.0]])


def segment_distance(point: Floats, start: Floats, end: Floats) -> float:
    """Return the distance of a point from a segment."""
    along = np.clip((point - start) @ (end - start) / ((end - start) @ (end - start)), 0.0, 1.0)
    return float(np.linalg.norm(start + along * (end - start) - point))


def gap(chain: Floats, base: Floats, puck: Floats) -> float:
    """Return the free distance between a puck and the tool whose chain (4, 2) is held at `base`."""
    return min(segment_distance(puck, *ends) for ends in pairwise(chain + base)) - REACH


def many_designs(count: int) -> Floats:
    """Return all corners of the design space and `count` designs inside, in its units."""
    space = load_task("push").design_space
    inside = np.random.default_rng(7).uniform(-1.0, 1.0, size=(count, space.size))
    return space.from_unit(np.vstack([list(product((-1.0, 1.0), repeat=space.size)), inside]))


def test_no_tool_starts_on_the_puck() -> None:
    chains = push.chain_points(many_designs(2_000), push.FIRST_LINK_ANGLE)
    shifts = push.start_shift(chains)
    for chain, shift in zip(chains, shifts, strict=True):
        assert gap(chain, started(shift), push.PUCK_START) >= push.START_CLEARANCE - 1e-9
    assert (shifts == 0.0).any()
    assert (shifts != 0.0).any()
    low, high = push.WORKSPACE.low[0], push.WORKSPACE.high[0]
    assert low <= push.TOOL_START[0] + shifts.min() <= push.TOOL_START[0] + shifts.max() <= high


def test_tools_are_moved_no_further_than_needed() -> None:
    chains = push.chain_points(many_designs(200), push.FIRST_LINK_ANGLE)
    for chain, shift in zip(chains, push.start_shift(chains), strict=True):
        for nearer in np.linspace(-1.0, 1.0, 41) * (abs(shift) - 1e-4):
            if shift != 0.0:
                assert gap(chain, started(nearer), push.PUCK_START) < push.START_CLEARANCE


def started(shift: float) -> Floats:
    """Return where a tool that is moved by `shift` is held."""
    held: Floats = push.TOOL_START + np.array([shift, 0.0])
    return held


def test_the_simulator_starts_tools_where_the_geometry_says() -> None:
    designs, task = many_designs(50), load_task("push")
    episodes, slots = Episodes(task, len(designs)), np.arange(len(designs))
    episodes.begin(slots, np.tile(goal_at(push.GOAL_DISTANCE[0], 0.0), (len(designs), 1)))
    episodes.design(slots, task.design_space.to_unit(designs))
    shifts = push.start_shift(push.chain_points(designs, push.FIRST_LINK_ANGLE))
    base = task.layout.split(episodes.observation).state[:, push.BASE]
    np.testing.assert_allclose(base[:, 0], push.TOOL_START[0] + shifts, atol=1e-5)
    np.testing.assert_allclose(base[:, 1], push.TOOL_START[1], atol=1e-5)
    for slot in slots:  # pymunk's own shapes leave the clearance, too.
        simulator: Any = episodes.simulator
        space: pymunk.Space = simulator.spaces[slot]
        space.step(1e-9)
        links = links_of(space)
        assert len(links) == 3
        free = min(link.point_query(tuple(push.PUCK_START)).distance for link in links) - push.PUCK_RADIUS
        assert free >= push.START_CLEARANCE - 1e-6


def test_goals_lie_in_the_ring_uniform_in_area() -> None:
    goals = load_task("push").sample_instances(np.random.default_rng(0), 20_000)
    distance = np.linalg.norm(goals - push.PUCK_START, axis=1)
    near, far = push.GOAL_DISTANCE
    assert near <= distance.min() <= distance.max() <= far
    middle = np.sqrt(0.5 * (near**2 + far**2))  # This circle halves the ring's area.
    assert (distance < middle).mean() == pytest.approx(0.5, abs=0.015)
    assert (goals[:, 0] > push.PUCK_START[0]).mean() == pytest.approx(0.5, abs=0.015)


def test_a_straight_tool_pushes_the_puck_left_into_the_goal() -> None:
    outcome = play(goal_at(np.mean(push.GOAL_DISTANCE), np.pi), push_left, as_built)
    assert outcome.success
    assert outcome.terminated
    assert len(outcome.reward) - 1 < load_task("push").horizon
    assert sum(outcome.reward) > push.SUCCESS_REWARD
    assert outcome.reward[-1] > 0.5 * push.SUCCESS_REWARD
    assert max(outcome.reward[:-1]) < 0.5 * push.SUCCESS_REWARD


def test_nothing_happens_to_an_idle_tool() -> None:
    task = load_task("push")
    outcome = play(goal_at(push.GOAL_DISTANCE[0], 0.0), stay, as_built)
    assert not outcome.terminated
    assert len(outcome.reward) == task.horizon
    np.testing.assert_allclose(outcome.puck[-1], push.PUCK_START, atol=1e-9)
    assert sum(outcome.reward) == pytest.approx(task.horizon * push.SLACK_REWARD)


def speed_for(distance: float) -> float:
    """Return the speed from which the table's friction stops a puck after `distance`: v^2 / 2a."""
    return float(np.sqrt(2.0 * push.PUCK_DECELERATION * distance))


@pytest.mark.parametrize("angle", [np.pi, 0.5 * np.pi, 0.75 * np.pi])
def test_a_sliding_puck_stops_by_the_documented_friction(angle: float) -> None:
    speed = speed_for(3.0)
    direction = np.array([np.cos(angle), np.sin(angle)])
    outcome = play(goal_at(push.GOAL_DISTANCE[1], angle + np.pi), stay, slide(speed, angle))
    np.testing.assert_allclose(outcome.puck[-1], outcome.puck[-2], atol=1e-9)
    # Semi-implicit steps are off by up to the way of one of them.
    np.testing.assert_allclose(outcome.puck[-1] - push.PUCK_START, 3.0 * direction, atol=speed * push.CLOCK.period)


def test_a_puck_that_stops_at_the_goal_succeeds_and_one_that_passes_through_does_not() -> None:
    distance = push.GOAL_DISTANCE[0]
    goal = goal_at(distance, np.pi)
    stops = play(goal, stay, slide(speed_for(distance), np.pi))
    passes = play(goal, stay, slide(speed_for(distance + push.GOAL_RADIUS + 1.0), np.pi))
    assert stops.success
    assert not passes.success
    nearest = min(np.linalg.norm(puck - goal[0]) for puck in passes.puck)
    assert nearest < push.GOAL_RADIUS, "it did pass through the goal"


@pytest.mark.parametrize("prepare", [as_built, slide(4.0, np.pi), slide(6.0, 0.7 * np.pi), slide(6.0, 0.0)])
def test_rewards_add_up_to_the_share_of_the_way_made(prepare: Callable[[pymunk.Space], None]) -> None:
    goal = goal_at(push.GOAL_DISTANCE[1], 0.8 * np.pi)
    outcome = play(goal, push_left, prepare)
    first, last = (float(np.linalg.norm(puck - goal[0])) for puck in (outcome.puck[0], outcome.puck[-1]))
    steps = len(outcome.reward)
    expected = (first - last) / first + push.SLACK_REWARD * steps + push.SUCCESS_REWARD * outcome.success
    assert sum(outcome.reward) == pytest.approx(expected, abs=1e-9)


def test_nothing_explodes_or_tunnels_at_the_corners_of_the_design_space() -> None:
    task = load_task("push")
    designs = np.array(list(product((-1.0, 1.0), repeat=task.design_space.size)))
    chains = push.chain_points(task.design_space.from_unit(designs), push.FIRST_LINK_ANGLE)
    rng, slots = np.random.default_rng(3), np.arange(len(designs))
    episodes = Episodes(task, len(designs))
    episodes.begin(slots, task.sample_instances(rng, len(designs)))
    episodes.design(slots, designs)
    simulator: Any = episodes.simulator
    fastest, deepest, moved = 0.0, 0.0, np.zeros(len(designs), dtype=bool)
    for step in range(task.horizon):
        if step % 10 == 0:
            aim = simulator.bodies[:, 0, :2] + rng.normal(scale=4.0, size=(len(designs), 2))
            controls = np.sign(aim - simulator.bodies[:, 1, :2])  # At full speed to somewhere around the puck.
        simulator.step(slots, controls)  # Goes on behind a success, too.
        bodies = simulator.bodies
        assert np.isfinite(bodies).all()
        fastest = max(fastest, float(np.linalg.norm(bodies[:, 0, 2:], axis=1).max()))
        deepest = min(deepest, *(gap(chains[i], bodies[i, 1, :2], bodies[i, 0, :2]) for i in slots))
        moved |= np.linalg.norm(bodies[:, 0, :2] - push.PUCK_START, axis=1) > 0.1
    assert moved.mean() > 0.5, "most tools met the puck"
    # Links have no bounce: the puck is no faster than the held end can be, along the diagonal.
    assert fastest <= 1.05 * np.sqrt(2.0) * push.MAX_SPEED
    assert deepest >= -push.LINK_HALF_WIDTH, "the puck's edge never reaches a link's core"
