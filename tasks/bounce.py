"""Bounce: a bent strip sends three falling balls through a hoop. Docstring of `Bounce` has the details.

Shapes: `b` slots a call names, `I` = 9 instance, `D` = 5 design, `C` = 1 control, `K` = 3 balls, `P` = 8 points.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, ClassVar

import numpy as np
import pymunk

from codesign_bench.task import (
    OURS,
    Behaviour,
    Booleans,
    Box,
    ByProfile,
    Floats,
    Given,
    Quantity,
    Simulator,
    Slots,
    Soundness,
    Task,
    ToolPart,
    constants,
)

from ._planar import COLOURS, PLACE, Canvas, Clock, PlanarSimulator, View
from ._sides import TwoSides
from ._strip import (
    MIDDLE,
    SEGMENTS,
    STRIP_HALF_WIDTH,
    STRIP_SCENE,
    strip_graph,
    strip_parts,
    strip_tool,
)

SIDE_LENGTH: Annotated[tuple[float, float], Given("m", OURS)] = (0.6, 1.7)
"""Range of the length of the strip on either side of the hand."""
TILT: Annotated[float, Given("rad", OURS)] = np.deg2rad(20.0)
"""Largest heading of the strip's middle, in either direction."""
BEND: Annotated[float, Given("rad", OURS)] = np.deg2rad(15.0)
"""Largest share of the heading at an end that has the opposite sign at the other: a dish or a dome."""
CURL: Annotated[float, Given("rad", OURS)] = np.deg2rad(10.0)
"""Largest share of the heading at an end that has the same sign at the other, and is 0 in the middle."""

RAIL: Annotated[float, Given("m", OURS)] = 0.4
"""How far the hand can move to the left or right."""
MAX_SPEED: Annotated[float, Given("m/s", OURS)] = 0.8
"""Largest speed of the hand: it adds little to the speed of a ball."""

NUM_BALLS: Annotated[int, Given("balls", OURS)] = 3
"""Number of balls in an episode."""
BALL_RADIUS: Annotated[float, Given("m", OURS)] = 0.2
"""Radius of a ball."""
GRAVITY: Annotated[float, Given("m/s^2", OURS)] = 10.0
"""Of the scene."""
RESTITUTION: Annotated[float, Given("1", OURS)] = 0.8
"""Speed across the strip after a bounce, as a fraction of that before. There is no friction."""
COLUMNS: Annotated[tuple[float, ...], Given("m", OURS)] = (-1.0, 0.0, 1.0)
"""Where the balls fall, relative to their common place."""
COMMON_PLACE: Annotated[float, Given("m", OURS)] = 0.3
"""Largest distance of the common place from the hand's start."""
SCATTER: Annotated[float, Given("m", OURS)] = 0.1
"""Largest distance of a ball from its column."""
DROP_HEIGHT: Annotated[tuple[float, float], Given("m", OURS)] = (4.2, 4.8)
"""Lowest and highest start of a ball above the hand."""

HOOP_DISTANCE: Annotated[tuple[float, float], Given("m", OURS)] = (2.8, 4.2)
"""Smallest and largest distance of the hoop's centre from the hand's start, along x: no strip reaches it."""
HOOP_HEIGHT: Annotated[tuple[float, float], Given("m", OURS)] = (-1.0, 0.5)
"""Lowest and highest hoop, relative to the hand."""
HOOP_HALF_WIDTH: Annotated[float, Given("m", OURS)] = 0.6
"""Half the width of the hoop."""

THROUGH_REWARD: Annotated[float, Given("1", OURS)] = 1.0
"""Added as balls go through the hoop, an equal part for each."""
SLACK_REWARD: Annotated[float, Given("1", OURS)] = -0.001
"""Added in every control step."""
SUCCESS_REWARD: Annotated[float, Given("1", OURS)] = 1.0
"""Added once, when all balls have gone through."""

FLOOR: Annotated[float, Given("m", OURS)] = -4.0
"""Height of the floor, on which balls come to rest."""
LOST_HEIGHT: Annotated[float, Given("m", OURS)] = -2.5
"""A ball below this, which is below every hoop and strip, has missed."""
WALLS: Annotated[tuple[float, float], Given("m", OURS)] = (-7.0, 7.0)
"""Walls on the left and right, behind every hoop."""

HORIZON: Annotated[int, Given("control steps", OURS)] = 50
"""Time limit."""
STEPS_PER_CONTROL: Annotated[int, Given("physics steps", OURS)] = 16
"""In a control step."""
PHYSICS_PERIOD: Annotated[float, Given("s", OURS)] = 1.0 / 240.0
"""Of a physics step: a ball that hits a strip moves a fifth of its radius."""
CLOCK = Clock(STEPS_PER_CONTROL, PHYSICS_PERIOD)


SIDES_OF_GOAL = TwoSides(HOOP_DISTANCE, HOOP_HEIGHT)

DESIGN = Box.of(
    tilt=(-TILT, TILT, "rad"),
    bend=(-BEND, BEND, "rad"),
    curl=(-CURL, CURL, "rad"),
    left_length=(*SIDE_LENGTH, "m"),
    right_length=(*SIDE_LENGTH, "m"),
)
SHAPE, SIDES = DESIGN.slice("tilt", "bend", "curl"), DESIGN.slice("left_length", "right_length")
CONTROL = Box.of(velocity_x=(-MAX_SPEED, MAX_SPEED, "m/s"))
HAND_SPEED = CONTROL.index("velocity_x")
INSTANCE = Box.of(
    hoop_x=(-HOOP_DISTANCE[1], HOOP_DISTANCE[1], "m"),
    hoop_y=(*HOOP_HEIGHT, "m"),
    common_place=(-COMMON_PLACE, COMMON_PLACE, "m"),
    **{f"ball_{k + 1}_scatter": (-SCATTER, SCATTER, "m") for k in range(NUM_BALLS)},
    **{f"ball_{k + 1}_height": (*DROP_HEIGHT, "m") for k in range(NUM_BALLS)},
)
HOOP, PLACE_X = INSTANCE.slice("hoop_x", "hoop_y"), INSTANCE.index("common_place")
SCATTERS, HEIGHTS = (
    INSTANCE.slice(*(f"ball_{k + 1}_{what}" for k in range(NUM_BALLS))) for what in ("scatter", "height")
)

BALL = Box.of(
    from_hand_x=(-15.0, 15.0, "m"),
    from_hand_y=(-15.0, 15.0, "m"),
    velocity_x=(-15.0, 15.0, "m/s"),
    velocity_y=(-15.0, 15.0, "m/s"),
    through=(0.0, 1.0, "1"),
    nearest=(0.0, 15.0, "m"),
)
"""Observation of one ball."""
STATE = Box.of(
    hand_x=(-RAIL, RAIL, "m"),
    **{
        f"ball_{k + 1}_{name}": (low, high, unit)
        for k in range(NUM_BALLS)
        for name, low, high, unit in zip(BALL.names, BALL.low, BALL.high, BALL.units, strict=True)
    },
)
HAND, BALLS = STATE.index("hand_x"), STATE.group("ball_")

BALL_BODIES, TOOL_BODY = slice(0, NUM_BALLS), NUM_BALLS
"""Rows of `PlanarSimulator.bodies`."""


class Bounce(Task):
    """Send three falling balls through a hoop by the shape of the strip on which they bounce (ours).

    Seen from the side, a hand on a short rail holds a strip in its middle. Three balls fall side by side, bounce on
    different places of the strip, and must all come down through one hoop, which is to the left or to the right, higher
    or lower. The strip is to balls what a mirror is to light: how steep it is under a ball determines where that ball
    flies, so its tilt, its bend and its curl must bring three flights together. A hand that moves can only bring the
    strip beneath the balls; it turns nothing.

    Action space
        Design, 5: tilt, bend and curl of the strip (rad), and its lengths on both sides of the hand (m). Control, 1:
        velocity of the hand along x (m/s).

    Observation
        State, 19: position x of the hand (m); for each ball, displacement from the hand x, y (m), velocity x, y (m/s),
        whether it has gone through the hoop, and its smallest distance so far from the hoop's centre (m). Goal, 2:
        centre x, y of the hoop (m). Then the design and the phase.

    Design space
        A strip of seven straight segments of equal length on either side. The heading at u, the place along the strip
        from -1 at its left end to 1 at its right end, is tilt + bend u + curl u^2; a segment has the heading of its
        middle.

    Goal space
        Hoops at some distance to the left or right of the hand's start, at any of some heights, uniform. The balls'
        common place, their scatter around it and their heights vary, too. They are not part of the goal, but the state
        contains them at the design step.

    Reward
        The decrease of the smallest distance so far of each ball from the hoop's centre, as a fraction of its initial
        distance, averaged over balls; an equal part of a fixed reward for each ball that comes down through the hoop; a
        negative slack, and a bonus on success. An episode's return is below 3.

    Starting state
        The hand at rest in the middle of its rail, the balls at rest above the strip. Balls do not touch each other, as
        if they fell one behind the other in the picture.

    Episode end
        Success when all balls have come down through the hoop; failure when each has or is below it, and not all have;
        or the time limit.
    """

    name = "bounce"
    title = "Bounce"
    scene: ClassVar = {**STRIP_SCENE, **constants(__name__)}
    horizon = HORIZON
    control_period = CLOCK.control_period
    design_space = DESIGN
    # What bends the whole strip belongs to the segment that is held, a length to the next one on its side.
    tool_graph = strip_graph((MIDDLE, MIDDLE, MIDDLE, MIDDLE - 1, MIDDLE + 1))
    control_space = CONTROL
    instance_space = INSTANCE
    goal_size = 2
    position_entries = ("hoop_x", "hoop_y")
    state_space = STATE
    reward_terms: ClassVar = {
        "progress": f"sum over balls of (d_before - d_after) / ({NUM_BALLS} d_start), d the smallest distance so far "
        "from ball to hoop, m",
        "through": f"{THROUGH_REWARD:g} / {NUM_BALLS} for each ball that comes down through the hoop in this step",
        "slack": f"{SLACK_REWARD:g}",
        "success": f"{SUCCESS_REWARD:g} in the step that solves the task",
    }
    success_conditions: ClassVar = {
        "all_through": f"each of the {NUM_BALLS} balls has come down through the hoop: its centre passed the hoop's "
        f"height, downwards, within {HOOP_HALF_WIDTH:g} m of the hoop's centre"
    }
    failure_condition = (
        f"each ball has gone through the hoop or is below {LOST_HEIGHT:g} m, and not all have gone through"
    )

    run_settings: ClassVar[ByProfile] = {"workstation": {"steps": 2_000_000}}
    outcome = Quantity("balls through the hoop", "balls")
    soundness = Soundness(
        overlap=STRIP_HALF_WIDTH,
        speed=float(np.sqrt(2.0 * GRAVITY * (DROP_HEIGHT[1] - FLOOR))) + MAX_SPEED,
        outcome_change=0.5,
    )

    def sample_instances(self, rng: np.random.Generator, count: int) -> Floats:
        """Return (count, I) random instances; the hoop is left or right of the hand with equal probability."""
        instances = self.instance_space.sample(rng, count)
        instances[:, HOOP.start] = SIDES_OF_GOAL.sample_x(rng, count)
        return instances

    def in_region(self, instances: Floats) -> Booleans:
        """Return which goals (b, I) are within the ranges of distances and heights of the hoop."""
        return SIDES_OF_GOAL.contain(instances[:, HOOP])

    def in_cutout(self, instances: Floats, fraction: float) -> Booleans:
        """Return which goals (b, I) are in two patches, left and right, with `fraction` of the region's area."""
        return SIDES_OF_GOAL.in_patches(instances[:, HOOP], fraction)

    def material(self, designs: Floats) -> Floats:
        """Return the length of the strip as a fraction of the largest, for designs (b, D) in their units."""
        total: Floats = designs[:, SIDES].sum(axis=1) / (2.0 * SIDE_LENGTH[1])
        return total

    def effort(self, controls: Floats) -> Floats:
        """Return the speed of the hand as a fraction of the largest, for controls (b, C) in [-1, 1]."""
        speed: Floats = np.abs(controls[:, HAND_SPEED])
        return speed

    def tool_parts(self, design: Floats) -> tuple[ToolPart, ...]:
        """Return the segments of the strip of a design (D,) in its units."""
        return strip_parts(bent_strip(design[None])[0])

    def script(self) -> Behaviour:
        """Return a script that looks for the strip, and then for the place of the hand, from which balls fly best."""
        from ._scripts.bounce import BounceScript  # imported here because that file imports this one

        return BounceScript(self)

    def make_simulator(self, num_slots: int, refinement: int = 1) -> Simulator:
        """Return a simulator of `num_slots` hands with three balls each."""
        return _BounceSimulator(num_slots, self.state_space.size, CLOCK.refined(refinement))


class _BounceSimulator(PlanarSimulator):
    """Three balls and a kinematic strip per slot, between a floor and two walls that keep missed balls in view."""

    view = View(x=(WALLS[0] - 0.5, WALLS[1] + 0.5), y=(FLOOR - 0.5, 6.5))

    def __init__(self, num_slots: int, state_size: int, clock: Clock) -> None:
        super().__init__(num_slots, state_size, num_bodies=NUM_BALLS + 1, clock=clock)
        self.hoop = np.zeros((num_slots, 2))
        self.through = np.zeros((num_slots, NUM_BALLS), dtype=bool)
        self.start_distance = np.ones((num_slots, NUM_BALLS))
        self.distance = np.zeros((num_slots, NUM_BALLS))
        """(B, K): smallest distances so far of the balls from the hoop, m."""
        self.tools: list[pymunk.Body | None] = [None] * num_slots

    def begin(self, slots: Slots, instances: Floats) -> None:
        """Put hands at their start, balls and hoops where `instances` (b, I) say."""
        self.forget(slots)
        self.hoop[slots] = instances[:, HOOP]
        self.through[slots] = False
        starts = ball_starts(instances)
        self.start_distance[slots] = np.linalg.norm(starts - self.hoop[slots][:, None], axis=2)
        self.distance[slots] = self.start_distance[slots]
        self.bodies[slots, BALL_BODIES] = np.concatenate([starts, np.zeros_like(starts)], axis=2)
        self.bodies[slots, TOOL_BODY] = 0.0
        self._write_state(slots)

    def build(self, slots: Slots, designs: Floats) -> None:
        """Build the scenes with strips of `designs` (b, D)."""
        self.add_spaces(slots, bent_strip(designs))

    def build_space(self, slot: int, points: Floats) -> pymunk.Space:
        """Return the scene of one episode: balls, strip, floor and walls."""
        space = pymunk.Space()
        space.gravity = (0.0, -GRAVITY)
        for x, y, _, _ in self.bodies[slot, BALL_BODIES].tolist():
            # Without friction on the strip balls do not spin; on the floor, where there is, they should come to rest.
            ball = pymunk.Body(1.0, float("inf"))
            ball.position = (x, y)
            disc = pymunk.Circle(ball, BALL_RADIUS)
            disc.friction = disc.elasticity = 1.0  # pymunk multiplies those of the two shapes of a contact
            disc.filter = pymunk.ShapeFilter(group=1)  # shapes of one group do not collide
            space.add(ball, disc)
        tool, shapes = strip_tool(points, friction=0.0, elasticity=RESTITUTION)
        space.add(tool, *shapes)
        space.add(*_surroundings(space.static_body))
        self.tools[slot] = tool
        return space

    def step(self, slots: Slots, controls: Floats) -> None:
        """Move the hands by `controls` (b, C) for one control step and reward the balls' flights."""
        period = self.clock.control_period
        hand = self.bodies[slots, TOOL_BODY, 0]
        # A kinematic hand is not stopped by the end of its rail, so its target is limited instead.
        target = np.clip(hand + controls[:, HAND_SPEED] * MAX_SPEED * period, -RAIL, RAIL)
        for slot, speed in zip(slots.tolist(), ((target - hand) / period).tolist(), strict=True):
            tool = self.tools[slot]
            assert tool is not None, "a tool is built before it is moved"
            tool.velocity = (speed, 0.0)
        before = self.bodies[slots, BALL_BODIES, PLACE]
        self.advance(slots)
        after = self.read_bodies(slots)[:, BALL_BODIES, PLACE]
        hoop = self.hoop[slots][:, None]
        passed = comes_through(before, after, hoop) & ~self.through[slots]
        through = self.through[slots] | passed
        distance = np.minimum(self.distance[slots], way_distance(before, after, hoop))
        decrease = (self.distance[slots] - distance) / self.start_distance[slots]
        self.set_success(slots, all_through=np.all(through, axis=1))
        self.set_reward(
            slots,
            progress=decrease.mean(axis=1),
            through=THROUGH_REWARD * passed.mean(axis=1),
            slack=SLACK_REWARD,
            success=SUCCESS_REWARD * self.success[slots],
        )
        missed = (after[..., 1] < LOST_HEIGHT) & ~through
        self.failure[slots] = missed.any(axis=1) & (missed | through).all(axis=1)
        self.through[slots], self.distance[slots] = through, distance
        self.outcome[slots] = through.sum(axis=1)
        self._write_state(slots)

    def mark(self, slot: int, canvas: Canvas) -> None:
        """Draw the hand's rail, and the hoop with a net below it."""
        canvas.segment((-RAIL, 0.0), (RAIL, 0.0), 0.04, COLOURS["scene"])
        x, y = self.hoop[slot].tolist()
        rim, foot = HOOP_HALF_WIDTH, 0.6 * HOOP_HALF_WIDTH
        corners = [(x - rim, y), (x - foot, y - rim), (x + foot, y - rim), (x + rim, y)]
        for start, end in pairwise(corners):
            canvas.segment(start, end, 0.03, COLOURS["goal"])
        for side in (corners[0], corners[-1]):
            canvas.circle(side, 0.1, COLOURS["goal"])

    def _write_state(self, slots: Slots) -> None:
        bodies = self.bodies[slots]
        self.state[slots, HAND] = bodies[:, TOOL_BODY, 0]
        balls = bodies[:, BALL_BODIES].copy()
        balls[..., PLACE] -= bodies[:, None, TOOL_BODY, PLACE]
        so_far = np.stack([self.through[slots], self.distance[slots]], axis=2)
        seen = np.concatenate([balls, so_far], axis=2)  # as in BALL
        self.state[slots, BALLS] = seen.reshape(len(slots), -1)


def bent_strip(designs: Floats) -> Floats:
    """Return the points (b, P, 2) of strips of `designs` (b, D), from left to right, relative to the hand, m.

    The hand is in the middle of the middle segment, which has half a segment's length on either side.
    """
    # Either side has its own length, so half of the middle segment is on the left and half on the right.
    ends = np.linspace(-1.0, 1.0, SEGMENTS + 1)
    middles = 0.5 * (ends[1:] + ends[:-1])
    tilt, bend, curl = (designs[:, [entry]] for entry in range(SHAPE.start, SHAPE.stop))
    heading = tilt + bend * middles + curl * middles**2
    direction = np.stack([np.cos(heading), np.sin(heading)], axis=2)  # (b, segments, 2)
    left, right = (designs[:, entry, None] for entry in range(SIDES.start, SIDES.stop))
    share = np.diff(ends)
    points = np.zeros((len(designs), SEGMENTS + 1, 2))
    # Half of the middle segment from the hand outwards, then whole segments: cumulative sums on both sides.
    steps = direction * share[:, None]
    steps[:, MIDDLE] *= 0.5
    points[:, MIDDLE + 1 :] = np.cumsum(steps[:, MIDDLE:], axis=1) * right[..., None]
    points[:, : MIDDLE + 1] = -np.cumsum(steps[:, MIDDLE::-1], axis=1)[:, ::-1] * left[..., None]
    return points


def ball_starts(instances: Floats) -> Floats:
    """Return where the balls of `instances` (b, I) start, (b, K, 2), m."""
    x = instances[:, PLACE_X, None] + np.array(COLUMNS) + instances[:, SCATTERS]
    return np.stack([x, instances[:, HEIGHTS]], axis=2)


def comes_through(before: Floats, after: Floats, hoop: Floats) -> Booleans:
    """Return which balls (b, K) came down through hoops (b, 1, 2) on the way from `before` to `after` (b, K, 2)."""
    fall = before[..., 1] - after[..., 1]
    crosses = (before[..., 1] > hoop[..., 1]) & (after[..., 1] <= hoop[..., 1])
    share = (before[..., 1] - hoop[..., 1]) / np.where(crosses, fall, 1.0)
    x = before[..., 0] + share * (after[..., 0] - before[..., 0])
    result: Booleans = crosses & (np.abs(x - hoop[..., 0]) < HOOP_HALF_WIDTH)
    return result


def way_distance(before: Floats, after: Floats, hoop: Floats) -> Floats:
    """Return the distances (b, K) of hoops (b, 1, 2) from the straight ways `before` to `after` (b, K, 2), m."""
    way, to_hoop = after - before, hoop - before
    along = (way * to_hoop).sum(axis=2) / np.maximum((way**2).sum(axis=2), 1e-12)
    nearest = before + np.clip(along, 0.0, 1.0)[..., None] * way
    distance: Floats = np.linalg.norm(nearest - hoop, axis=2)
    return distance


def _surroundings(body: pymunk.Body) -> list[pymunk.Segment]:
    """Return floor and walls, on which balls do not bounce, thick enough that nothing passes through them."""
    (left, right), thickness = WALLS, 1.0
    corners = [
        ((left - thickness, FLOOR - thickness), (right + thickness, FLOOR - thickness)),
        ((left - thickness, FLOOR), (left - thickness, FLOOR + 40.0)),
        ((right + thickness, FLOOR), (right + thickness, FLOOR + 40.0)),
    ]
    shapes = [pymunk.Segment(body, *ends, thickness) for ends in corners]
    for shape in shapes:
        shape.friction = 1.0
    return shapes
