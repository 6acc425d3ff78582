"""Gather against its documentation: blades, starts, drag, what a slanted wall does, success, reward.

Nothing here depends on a tuned number: all of them are read from the task's module. Lengths are in m, times in s.
"""

from __future__ import annotations

from itertools import combinations, product
from typing import Any

import numpy as np
import pymunk
import pytest

from codesign_bench.registry import load_module
from codesign_bench.task import Floats, load_task
from codesign_bench.task.episodes import Episodes

pytestmark = pytest.mark.numeric

gather: Any = load_module("tasks", "gather")
TASK = load_task("gather")
SLOT = np.array([0])
LEVEL = np.zeros((1, gather.SEGMENTS))
"""A blade without rises, normalised."""
IDLE, FORWARDS = np.zeros((1, 2)), np.array([[0.0, 1.0]])


def instance_with(goal: tuple[float, float]) -> Floats:
    """Return the instance (1, I) with this goal and grains exactly in their rows and columns."""
    return np.array([[*goal, *[0.0] * (2 * gather.NUM_GRAINS)]])


def begin(goal: tuple[float, float] = (1.0, 5.0), design: Floats = LEVEL) -> tuple[Episodes, Any]:
    """Return an episode after its design step, and its simulator."""
    episodes = Episodes(TASK, 1)
    episodes.begin(SLOT, instance_with(goal))
    episodes.design(SLOT, design)
    return episodes, episodes.simulator


def grains_of(simulator: Any) -> Floats:
    """Return places and velocities of the grains of slot 0, (N, 4)."""
    grains: Floats = simulator.bodies[0, gather.GRAIN_BODIES].copy()
    return grains


def put(simulator: Any, places: Floats, velocity: tuple[float, float] = (0.0, 0.0)) -> None:
    """Move the grains of slot 0 to `places` (N, 2)."""
    bodies = [body for body in simulator.spaces[0].bodies if body.body_type == pymunk.Body.DYNAMIC]
    for body, place in zip(bodies, places.tolist(), strict=True):
        body.position, body.velocity = tuple(place), velocity


def test_a_blade_goes_through_its_rises_and_is_held_in_the_middle_of_its_middle_segment() -> None:
    rises = np.array([[0.1, 0.2, 0.3, 0.4, -0.1, -0.2, -0.3]])
    points = gather.blade(rises)[0]
    np.testing.assert_allclose(np.diff(points[:, 1]), rises[0])
    np.testing.assert_allclose(np.diff(points[:, 0]), gather.SEGMENT_WIDTH)
    np.testing.assert_allclose(points[gather.MIDDLE : gather.MIDDLE + 2].mean(axis=0), 0.0, atol=1e-12)


def test_every_blade_starts_at_the_same_distance_behind_the_grains() -> None:
    inside = np.random.default_rng(7).uniform(-1.0, 1.0, size=(200, gather.SEGMENTS))
    designs = np.vstack([list(product((-1.0, 1.0), repeat=gather.SEGMENTS)), inside])
    slots = np.arange(len(designs))
    episodes = Episodes(TASK, len(slots))
    episodes.begin(slots, np.repeat(instance_with((1.0, 5.0)), len(slots), axis=0))
    episodes.design(slots, designs)
    hand = TASK.layout.split(episodes.observation).state[:, gather.HAND]
    foremost = hand[:, 1] + gather.blade(TASK.design_space.from_unit(designs))[..., 1].max(axis=1)
    nearest = min(gather.ROWS) - gather.SCATTER - gather.GRAIN_RADIUS
    np.testing.assert_allclose(nearest - foremost - gather.STRIP_HALF_WIDTH, gather.START_CLEARANCE, atol=1e-5)
    assert hand[:, 1].min() >= gather.LOWEST_START - 1e-5


def test_grains_never_overlap_at_the_start_and_lie_before_the_blade() -> None:
    grains = gather.grain_starts(TASK.sample_instances(np.random.default_rng(0), 2_000))
    for first, second in combinations(range(gather.NUM_GRAINS), 2):
        assert np.linalg.norm(grains[:, first] - grains[:, second], axis=1).min() > 2.0 * gather.GRAIN_RADIUS
    assert np.abs(grains[..., 0]).max() < gather.KNOTS_X[-1] - gather.SIDEWAYS


def test_circles_are_left_and_right_equally_often_and_never_straight_ahead() -> None:
    goals = TASK.sample_instances(np.random.default_rng(0), 20_000)[:, gather.GOAL]
    side = np.abs(goals[:, 0])
    near, far = gather.GOAL_SIDE
    assert near <= side.min() <= side.max() <= far
    assert (goals[:, 0] > 0.0).mean() == pytest.approx(0.5, abs=0.015)
    assert (goals[:, 1] < np.mean(gather.GOAL_Y)).mean() == pytest.approx(0.5, abs=0.015)


def test_a_free_grain_slides_on_as_far_as_the_drag_says() -> None:
    episodes, simulator = begin()
    places = np.stack([np.arange(gather.NUM_GRAINS), np.full(gather.NUM_GRAINS, 3.0)], axis=1)
    put(simulator, places, velocity=(0.0, 2.0))
    for _ in range(30):
        episodes.control(SLOT, IDLE)
    # v' = -r v stops after v / r; steps of length h make it shorter by up to h v.
    np.testing.assert_allclose(
        grains_of(simulator)[:, 1] - 3.0, 2.0 / gather.DRAG, atol=2.0 * gather.PHYSICS_PERIOD + 1e-6
    )


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_slanted_blade_moves_grains_to_its_rear_end_and_a_level_one_straight_ahead(side: float) -> None:
    moved = []
    for rise in (0.0, -side):  # a wall that falls back to the right sends grains to the right
        episodes, simulator = begin(design=np.full((1, gather.SEGMENTS), rise))
        before = grains_of(simulator)[:, 0]
        for _ in range(40):
            episodes.control(SLOT, FORWARDS)
        moved.append(grains_of(simulator)[:, 0] - before)
    straight, slanted = moved
    assert np.abs(straight).max() < gather.GRAIN_RADIUS
    assert (side * slanted > 2.0 * gather.GRAIN_RADIUS).all()


def test_success_is_that_all_grains_have_rested_in_the_circle_for_some_steps() -> None:
    goal = np.array([1.0, 5.0])
    angles = np.linspace(0.0, 2.0 * np.pi, gather.NUM_GRAINS, endpoint=False)
    ring = goal + 0.5 * gather.GOAL_RADIUS * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    episodes, simulator = begin()
    put(simulator, ring)
    for step in range(gather.REST_STEPS):
        assert not episodes.success(SLOT)[0], step
        episodes.control(SLOT, IDLE)
    assert episodes.success(SLOT)[0]
    assert simulator.outcome[0] == gather.NUM_GRAINS
    ring[0] = goal + np.array([1.1 * gather.GOAL_RADIUS, 0.0])
    episodes, simulator = begin()
    put(simulator, ring)
    for _ in range(2 * gather.REST_STEPS):
        episodes.control(SLOT, IDLE)
    assert not episodes.success(SLOT)[0]
    assert simulator.outcome[0] == gather.NUM_GRAINS - 1


def test_rewards_add_up_to_the_share_of_the_way_made() -> None:
    goal = (1.0, 5.0)
    episodes, simulator = begin(goal)
    first = np.linalg.norm(grains_of(simulator)[:, :2] - goal, axis=1).mean()
    rewards = [episodes.control(SLOT, FORWARDS)[0][0] for _ in range(35)]
    last = np.linalg.norm(grains_of(simulator)[:, :2] - goal, axis=1).mean()
    assert last < first
    assert sum(rewards) == pytest.approx((first - last) / first + gather.SLACK_REWARD * len(rewards))


def test_the_hand_stays_in_its_strip_and_keeps_to_its_speeds() -> None:
    episodes, simulator = begin()
    hand = [simulator.bodies[0, gather.TOOL_BODY, :2].copy()]
    for _ in range(TASK.horizon):
        episodes.control(SLOT, np.ones((1, 2)))
        hand.append(simulator.bodies[0, gather.TOOL_BODY, :2].copy())
    steps = np.diff(hand, axis=0) / gather.CLOCK.control_period
    np.testing.assert_allclose(hand[-1], [gather.SIDEWAYS, gather.FARTHEST], atol=1e-9)
    np.testing.assert_allclose(steps.max(axis=0), gather.MAX_SPEED)
    assert steps.min() >= -1e-9
