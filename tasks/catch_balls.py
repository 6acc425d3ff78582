"""Catch balls: a hand on a rail brings a chain of links beneath three thrown balls. Docstring of `CatchBalls` has more.

Shapes: `b` slots a call names, `I` = 10 instance, `D` = 5 design, `C` = 1 control, `K` = 3 balls, `L` = 3 links.
"""

from __future__ import annotations

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

from ._planar import (
    CHAIN_GRAPH,
    CHAIN_SCENE,
    COLOURS,
    LINK_HALF_WIDTH,
    PLACE,
    VELOCITY,
    Canvas,
    Clock,
    PlanarSimulator,
    View,
    chain_design_space,
    chain_material,
    chain_parts,
    chain_points,
    chain_tool,
)

PAPER = "paper, table of catch balls"

HAND_START: Annotated[Floats, Given("m", PAPER, "tool_position_init")] = np.array([20.0, 10.0])
"""Where the held end starts; it moves only along x (paper)."""
LENGTH_INIT: Annotated[tuple[float, float, float], Given("m", PAPER, "tool_length_init")] = (2.0, 1.0, 1.0)
"""Of the links, from which the design space is made: length = initial length (1 + ratio)."""
LENGTH_RATIO: Annotated[tuple[float, float], Given("1", PAPER, "tool_length_ratio")] = (-0.5, 2.0)
"""Range of a length's ratio."""
ANGLE_SCALE: Annotated[float, Given("degrees", PAPER, "tool_angle_scale")] = 60.0
"""Angle of ratio 1: angle = scale * ratio."""
ANGLE_RATIO: Annotated[tuple[float, float], Given("1", PAPER, "tool_angle_ratio")] = (-1.0, 1.0)
"""Range of an angle's ratio."""
FIRST_LINK_ANGLE: Annotated[float, Given("rad", OURS)] = -0.5 * np.pi
"""The first link hangs down from the hand: both joints turned to one side form a pan on that side."""
RAIL: Annotated[float, Given("m", OURS)] = 5.0
"""How far the hand can move to the left or right within the time limit."""
MAX_SPEED: Annotated[float, Given("m/s", OURS)] = 1.0
"""Largest speed of the hand: too slow to bring a tool to the other side before the balls land."""
MAX_ACCELERATION: Annotated[float, Given("m/s^2", OURS)] = 10.0
"""Largest acceleration of the hand: too small to hit balls away."""

NUM_BALLS: Annotated[int, Given("balls", 'paper, appendix "Environment Details"')] = 3
"""Number of balls in an episode."""
BALL_RADIUS: Annotated[float, Given("m", OURS)] = 0.4
"""Radius of a ball."""
GRAVITY: Annotated[float, Given("m/s^2", OURS)] = 8.0
"""Of the scene."""
LINK_FRICTION: Annotated[float, Given("1", OURS)] = 0.4
"""Friction between link and ball. The first link has none, so that no ball balances on the hand."""
BALL_FRICTION: Annotated[float, Given("1", OURS)] = 0.04
"""Friction between two balls: too little for a stable tower."""

LANDING_DISTANCE: Annotated[tuple[float, float], Given("m", OURS)] = (1.0, 4.0)
"""Smallest and largest distance of the landing place from the hand's start."""
LANDING_SPREAD: Annotated[float, Given("m", OURS)] = 2.2
"""Largest distance of a single ball's landing place from it."""
START_HEIGHTS: Annotated[tuple[tuple[float, float], ...], Given("m", OURS)] = ((16.5, 17.0), (19.5, 20.0), (22.5, 23.0))
"""Lowest and highest start of each ball: above every tool, and so far apart that balls do not meet in the air.

The hand has time to move from one to the next.
"""
THROW_SPEED: Annotated[float, Given("m/s", OURS)] = 3.0
"""Largest speed along x at which a ball is thrown."""

SLOW: Annotated[float, Given("m/s", OURS)] = 0.5
"""A ball is at rest on the tool if it is slower than this relative to the tool."""
REST_HEIGHT: Annotated[float, Given("m", OURS)] = 0.9
"""A ball whose centre is less than this above a link is on the link itself, not on other balls."""
HOLD_STEPS: Annotated[int, Given("control steps", OURS)] = 15
"""A ball is caught once it has been held for this many consecutive steps."""
SLACK_REWARD: Annotated[float, Given("1", PAPER, "slack_reward")] = -0.001
"""Added in every control step."""
SUCCESS_REWARD: Annotated[float, Given("1", "ours; the paper lists one for its 3D tasks only")] = 1.0
"""Added once, when all balls are caught."""

FLOOR: Annotated[float, Given("m", OURS)] = -6.0
"""Height of the floor: a pile of three balls fits below the longest tool."""
WALLS: Annotated[tuple[float, float], Given("m", OURS)] = (6.0, 34.0)
"""Walls on the left and right: every tool stays more than two balls' width away from them."""

HORIZON: Annotated[int, Given("control steps", PAPER, "max_episode_steps")] = 150
"""Time limit."""
STEPS_PER_CONTROL: Annotated[int, Given("physics steps", OURS, "control_steps_per_action")] = 4
"""In a control step."""
PHYSICS_PERIOD: Annotated[float, Given("s", OURS)] = 1.0 / 120.0
"""Of a physics step: a ball that hits a tool moves less than a third of its radius."""
CLOCK = Clock(STEPS_PER_CONTROL, PHYSICS_PERIOD)


CONTROL = Box.of(velocity_x=(-MAX_SPEED, MAX_SPEED, "m/s"))
HAND_SPEED = CONTROL.index("velocity_x")
INSTANCE = Box.of(
    landing_x=(float(HAND_START[0]) - LANDING_DISTANCE[1], float(HAND_START[0]) + LANDING_DISTANCE[1], "m"),
    **{f"ball_{k + 1}_offset": (-LANDING_SPREAD, LANDING_SPREAD, "m") for k in range(NUM_BALLS)},
    **{f"ball_{k + 1}_height": (*START_HEIGHTS[k], "m") for k in range(NUM_BALLS)},
    **{f"ball_{k + 1}_speed": (-THROW_SPEED, THROW_SPEED, "m/s") for k in range(NUM_BALLS)},
)
LANDING = INSTANCE.index("landing_x")
OFFSETS, HEIGHTS, SPEEDS = (
    INSTANCE.slice(*(f"ball_{k + 1}_{what}" for k in range(NUM_BALLS))) for what in ("offset", "height", "speed")
)

BALL = Box.of(
    from_hand_x=(-25.0, 25.0, "m"),
    from_hand_y=(-25.0, 25.0, "m"),
    velocity_x=(-25.0, 25.0, "m/s"),
    velocity_y=(-25.0, 25.0, "m/s"),
    held=(0.0, 1.0, "1"),
)
"""Observation of one ball."""
STATE = Box.of(
    hand_x=(float(HAND_START[0]) - RAIL, float(HAND_START[0]) + RAIL, "m"),
    hand_velocity=(-MAX_SPEED, MAX_SPEED, "m/s"),
    **{
        f"ball_{k + 1}_{name}": (low, high, unit)
        for k in range(NUM_BALLS)
        for name, low, high, unit in zip(BALL.names, BALL.low, BALL.high, BALL.units, strict=True)
    },
)
HAND, HAND_VELOCITY, BALLS = STATE.index("hand_x"), STATE.index("hand_velocity"), STATE.group("ball_")

BALL_BODIES, TOOL_BODY = slice(0, NUM_BALLS), NUM_BALLS
"""Rows of `PlanarSimulator.bodies`."""


class CatchBalls(Task):
    """Catch three balls that fall from the sky (paper, appendix "Environment Details").

    Seen from the side, a hand moves along a rail and holds a chain of three links. The first hangs down from the hand;
    the other two can turn to the left or to the right and form a pan on that side. The balls are thrown and land around
    one place to the left or to the right of the hand. The hand is too slow to bring a pan from one side to the other
    before they land, so a tool for one side hardly catches on the other. The distance of the landing place determines
    how long the links must be, or how far the hand must move.

    Action space
        Design, 5: lengths of the three links (m) and the two angles between them (rad) (paper). Control, 1: velocity of
        the hand along x (m/s) (paper; range ours); the hand's acceleration is limited (ours).

    Observation
        State, 17: position x (m) and velocity (m/s) of the hand; for each ball, displacement from the hand x, y (m),
        velocity x, y (m/s), and whether it is held. Goal, 1: x of the landing place (m). Then the design and the phase.

    Design space
        Length = initial length (1 + ratio), angle = scale * ratio (our reading of the paper's table). The first link
        points down (ours); positive angles turn the chain to the right.

    Goal space
        Landing places to the left or right of the hand's start, uniform (ours). The balls' starts vary as in the paper:
        each ball has a height, a speed along x, and a position near the goal at which it reaches the hand's height.
        They are not part of the goal, but the state contains them at the design step.

    Reward
        The change in the fraction of balls that are held, plus the paper's slack (negative) and a bonus on success. A
        ball is held if it is on a link, below the hand, and slow relative to the tool; a ball on other balls is not
        held. Dropping a ball costs what holding it earned, so nothing is earned twice. An episode's return is below 2.

    Starting state
        The hand at rest at the paper's position; the balls above every tool, at different heights (ours).

    Episode end
        Success when every ball is caught, that is, all have been held for some steps; failure when a ball is lost and
        all others are lost or caught; or the time limit.
    """

    name = "catch_balls"
    title = "Catch balls"
    version = 2
    scene: ClassVar = {**CHAIN_SCENE, **constants(__name__)}
    horizon = HORIZON
    control_period = CLOCK.control_period
    design_space = chain_design_space(LENGTH_INIT, LENGTH_RATIO, ANGLE_SCALE, ANGLE_RATIO)
    tool_graph = CHAIN_GRAPH
    control_space = CONTROL
    instance_space = INSTANCE
    goal_size = 1
    position_entries = ("landing_x",)
    state_space = STATE
    reward_terms: ClassVar = {
        "progress": f"(k_now - k_before) / {NUM_BALLS}, k the number of balls held: above a link by less than "
        f"{REST_HEIGHT:g} m, below the hand, and slower than {SLOW:g} m/s as seen from the tool",
        "slack": f"{SLACK_REWARD:g}",
        "success": f"{SUCCESS_REWARD:g} in the step that solves the task",
    }
    success_conditions: ClassVar = {"all_held": f"all {NUM_BALLS} balls are held"}
    success_steps = HOLD_STEPS
    failure_condition = "a ball has fallen below the tool, and every other one has, too, or is caught"

    run_settings: ClassVar[ByProfile] = {
        "quick": {"steps": 400_000, "tradeoff_scale": 0.02},
        "laptop": {"tradeoff_scale": 0.02},
        "workstation": {"steps": 1_000_000, "tradeoff_scale": 0.02},
    }
    outcome = Quantity("balls held", "balls")
    soundness = Soundness(
        overlap=LINK_HALF_WIDTH,
        speed=MAX_SPEED + float(np.hypot(THROW_SPEED, np.sqrt(2.0 * GRAVITY * (START_HEIGHTS[-1][1] - FLOOR)))),
        outcome_change=0.5,
    )

    def sample_instances(self, rng: np.random.Generator, count: int) -> Floats:
        """Return (count, I) random throws; the balls land left or right of the hand with equal probability."""
        instances = self.instance_space.sample(rng, count)
        distance = rng.uniform(*LANDING_DISTANCE, size=count)
        instances[:, LANDING] = HAND_START[0] + distance * np.where(rng.random(count) < 0.5, -1.0, 1.0)
        return instances

    def in_region(self, instances: Floats) -> Booleans:
        """Return which goals (b, I) are within the range of landing distances from the hand."""
        near, far = LANDING_DISTANCE
        distance = np.abs(instances[:, LANDING] - HAND_START[0])
        inside: Booleans = (near <= distance) & (distance <= far)
        return inside

    def in_cutout(self, instances: Floats, fraction: float) -> Booleans:
        """Return which goals (b, I) are in the middle `fraction` of the landing places on the left or on the right.

        These are two patches (ours, after the paper's patches of fetch cube).
        """
        near, far = LANDING_DISTANCE
        distance = np.abs(instances[:, LANDING] - HAND_START[0])
        result: Booleans = np.abs(distance - 0.5 * (near + far)) < 0.5 * fraction * (far - near)
        return result

    def material(self, designs: Floats) -> Floats:
        """Return the total link length as a fraction of the largest, for designs (b, D) in their units."""
        return chain_material(designs, self.design_space)

    def effort(self, controls: Floats) -> Floats:
        """Return the speed of the hand as a fraction of the largest, for controls (b, C) in [-1, 1]."""
        speed: Floats = np.abs(controls[:, HAND_SPEED])
        return speed

    def tool_parts(self, design: Floats) -> tuple[ToolPart, ...]:
        """Return the links of the tool of a design (D,) in its units."""
        return chain_parts(chain_points(design[None], FIRST_LINK_ANGLE)[0], LINK_HALF_WIDTH)

    def script(self) -> Behaviour:
        """Return a script that builds a pan on the side where the balls land and moves its middle beneath them."""
        from ._scripts.catch_balls import CatchBallsScript  # imported here because that file imports this one

        return CatchBallsScript(self)

    def make_simulator(self, num_slots: int, refinement: int = 1) -> Simulator:
        """Return a simulator of `num_slots` hands with three balls each."""
        return _CatchSimulator(num_slots, self.state_space.size, CLOCK.refined(refinement))


class _CatchSimulator(PlanarSimulator):
    """Three balls and a kinematic tool per slot, between a floor and two walls that keep missed balls in view."""

    view = View(x=(WALLS[0] - 0.5, WALLS[1] + 0.5), y=(FLOOR - 1.0, FLOOR + 31.0))

    def __init__(self, num_slots: int, state_size: int, clock: Clock) -> None:
        super().__init__(num_slots, state_size, num_bodies=NUM_BALLS + 1, clock=clock)
        self.landing = np.zeros(num_slots)
        self.points = np.zeros((num_slots, 4, 2))
        """(B, 4, 2): corners of the tools relative to the hand, m."""
        self.velocity = np.zeros(num_slots)
        """(B,) velocities of the hands, m/s."""
        self.held = np.zeros((num_slots, NUM_BALLS), dtype=bool)
        self.held_steps = np.zeros((num_slots, NUM_BALLS), dtype=np.intp)
        """(B, K): consecutive control steps for which each ball has been held."""
        self.tools: list[pymunk.Body | None] = [None] * num_slots

    def begin(self, slots: Slots, instances: Floats) -> None:
        """Put hands at their start and balls at the start of the throws `instances` (b, I)."""
        starts, speeds = throws(instances)
        self.forget(slots)
        self.landing[slots] = instances[:, LANDING]
        self.velocity[slots] = 0.0
        self.points[slots] = 0.0
        self.held[slots] = False
        self.held_steps[slots] = 0
        self.bodies[slots, BALL_BODIES] = np.concatenate([starts, speeds], axis=2)
        self.bodies[slots, TOOL_BODY] = (*HAND_START, 0.0, 0.0)
        self._write_state(slots)

    def build(self, slots: Slots, designs: Floats) -> None:
        """Build the scenes with tools of `designs` (b, D)."""
        self.points[slots] = chain_points(designs, FIRST_LINK_ANGLE)
        self.add_spaces(slots, self.points[slots])

    def build_space(self, slot: int, points: Floats) -> pymunk.Space:
        """Return the scene of one episode: balls, tool, floor and walls."""
        space = pymunk.Space()
        space.gravity = (0.0, -GRAVITY)
        own_friction = BALL_FRICTION**0.5  # pymunk multiplies the two friction coefficients of a contact
        for x, y, velocity_x, velocity_y in self.bodies[slot, BALL_BODIES].tolist():
            # With an infinite moment of inertia, balls slide instead of rolling, so they come to rest on a tool.
            ball = pymunk.Body(1.0, float("inf"))
            ball.position, ball.velocity = (x, y), (velocity_x, velocity_y)
            disc = pymunk.Circle(ball, BALL_RADIUS)
            disc.friction = own_friction
            space.add(ball, disc)
        tool, links = chain_tool(points, LINK_FRICTION / own_friction)
        links[0].friction = 0.0
        tool.position = tuple(HAND_START.tolist())
        space.add(tool, *links)
        space.add(*_surroundings(space.static_body, LINK_FRICTION / own_friction))
        self.tools[slot] = tool
        return space

    def step(self, slots: Slots, controls: Floats) -> None:
        """Move the hands by `controls` (b, C) for one control step and reward newly held balls."""
        change = MAX_ACCELERATION * self.clock.control_period
        before = self.velocity[slots]
        velocity = np.clip(controls[:, HAND_SPEED] * MAX_SPEED, before - change, before + change)
        self.velocity[slots] = velocity
        for slot, speed in zip(slots.tolist(), velocity.tolist(), strict=True):
            tool = self.tools[slot]
            assert tool is not None, "a tool is built before it is moved"
            tool.velocity = (speed, 0.0)
        self.advance(slots)
        bodies, points = self.read_bodies(slots), self.points[slots]
        balls, hand = bodies[:, BALL_BODIES], bodies[:, TOOL_BODY]
        from_hand = balls - hand[:, None]
        held = is_held(points, from_hand[..., PLACE], from_hand[..., VELOCITY])
        steps = np.where(held, self.held_steps[slots] + 1, 0)
        caught = steps >= HOLD_STEPS
        lowest = hand[:, 1] + points[:, :, 1].min(axis=1)
        lost = balls[:, :, 1] < lowest[:, None]
        all_held: Booleans = np.all(held, axis=1)
        self.set_success(slots, HOLD_STEPS, all_held=all_held)
        self.set_reward(
            slots,
            progress=(held.sum(axis=1) - self.held[slots].sum(axis=1)) / NUM_BALLS,
            slack=SLACK_REWARD,
            success=SUCCESS_REWARD * self.success[slots],
        )
        self.failure[slots] = lost.any(axis=1) & (lost | caught).all(axis=1)
        self.outcome[slots] = held.sum(axis=1)
        self.held[slots], self.held_steps[slots] = held, steps
        self._write_state(slots)

    def mark(self, slot: int, canvas: Canvas) -> None:
        """Draw the hand's rail and the landing place."""
        x, y = HAND_START.tolist()
        canvas.segment((x - RAIL, y), (x + RAIL, y), 0.05, COLOURS["scene"])
        canvas.circle((self.landing[slot], y), 0.3, COLOURS["goal"])

    def _write_state(self, slots: Slots) -> None:
        hand, balls = self.bodies[slots, TOOL_BODY, PLACE], self.bodies[slots, BALL_BODIES]
        self.state[slots, HAND] = hand[:, 0]
        self.state[slots, HAND_VELOCITY] = self.velocity[slots]
        from_hand = balls[..., PLACE] - hand[:, None]
        seen = np.concatenate([from_hand, balls[..., VELOCITY], self.held[slots][:, :, None]], axis=2)  # as in BALL
        self.state[slots, BALLS] = seen.reshape(len(slots), -1)


def throws(instances: Floats) -> tuple[Floats, Floats]:
    """Return positions and velocities of the balls of `instances` (b, I) at the start, each (b, K, 2), m and m/s.

    Velocities are horizontal. A ball starts at the horizontal distance from its landing place that it covers until it
    falls to the height of the hand.
    """
    offset, height, speed = instances[:, OFFSETS], instances[:, HEIGHTS], instances[:, SPEEDS]
    fall = np.sqrt(2.0 / GRAVITY * (height - HAND_START[1]))
    start = instances[:, LANDING, None] + offset - speed * fall
    return np.stack([start, height], axis=2), np.stack([speed, np.zeros_like(speed)], axis=2)


def is_held(points: Floats, balls: Floats, velocity: Floats) -> Booleans:
    """Return which balls (b, K) are held by tools with chain `points` (b, 4, 2).

    `balls` (b, K, 2) are centres, `velocity` (b, K, 2) velocities, both relative to the hand. A ball that stays slow
    close above a link must rest on it; a ball on top of others is farther up. A ball above the hand's height does not
    count, because it would be balanced on the hand.
    """
    start, link = points[:, None, :-1], np.diff(points, axis=1)[:, None]
    sideways = np.where(np.abs(link[..., 0]) > 1e-6, link[..., 0], np.nan)  # nothing rests on an upright link
    along = (balls[:, :, None, 0] - start[..., 0]) / sideways
    clearance = balls[:, :, None, 1] - (start[..., 1] + along * link[..., 1])
    above = (along >= 0.0) & (along <= 1.0) & (clearance > 0.0) & (clearance < REST_HEIGHT)
    slow = (velocity**2).sum(axis=2) < SLOW**2
    held: Booleans = above.any(axis=2) & slow & (balls[:, :, 1] < 0.0)
    return held


def _surroundings(body: pymunk.Body, friction: float) -> list[pymunk.Segment]:
    """Return floor and walls, thick enough that nothing passes through them."""
    (left, right), thickness = WALLS, 1.0
    corners = [
        ((left - thickness, FLOOR - thickness), (right + thickness, FLOOR - thickness)),
        ((left - thickness, FLOOR), (left - thickness, FLOOR + 40.0)),
        ((right + thickness, FLOOR), (right + thickness, FLOOR + 40.0)),
    ]
    shapes = [pymunk.Segment(body, *ends, thickness) for ends in corners]
    for shape in shapes:
        shape.friction = friction
    return shapes
