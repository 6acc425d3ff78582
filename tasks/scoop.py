"""Scoop: a ladle of three links lifts a wanted number of balls out of a pile. Docstring of `Scoop` has the details.

Shapes: `B` slots, `b` slots a call names, `N` = 40 balls, `P` piles, `I` = 3 instance (wanted balls, pile, shift),
`D` = 5 design, `C` = 3 control, `M` = 24 places of the profile of a pile.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
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
    Physics,
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
    COLOURS,
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
    overlap,
)

PAPER = "paper, table of scoop"
TEXT = 'paper, appendix "Environment Details"'

TOOL_START: Annotated[Floats, Given("m", PAPER, "tool_position_init")] = np.array([15.0, 10.0])
"""Start of the tool: x of its first joint and y of its lowest point (our reading)."""
START_SHIFT: Annotated[float, Given("m", OURS)] = 0.4
"""Largest shift of the first joint's start to the left or right."""
LENGTH_INIT: Annotated[tuple[float, float, float], Given("m", PAPER, "tool_length_init")] = (6.0, 3.0, 3.0)
"""Of the links, from which the design space is made: length = initial length (1 + ratio)."""
LENGTH_RATIO: Annotated[tuple[float, float], Given("1", PAPER, "tool_length_ratio")] = (-0.7, 0.2)
"""Range of a length's ratio."""
ANGLE_SCALE: Annotated[float, Given("degrees", PAPER, "tool_angle_scale")] = 90.0
"""Angle of ratio 1: angle = scale * ratio."""
ANGLE_RATIO: Annotated[tuple[float, float], Given("1", PAPER, "tool_angle_ratio")] = (-0.1, 0.7)
"""Range of an angle's ratio."""
FIRST_LINK_ANGLE: Annotated[float, Given("rad", OURS)] = -np.pi / 3.0
"""The first link, the handle, points down to the right; the others curl up and form a ladle."""
LINK_HALF_WIDTH: Annotated[float, Given("m", OURS)] = 0.12
"""Half the thickness of a link: a fifth of a ball's radius, so that a tool displaces few balls in the pile."""
TOOL_MASS: Annotated[float, Given("kg", OURS)] = 8.0
"""Mass of the tool; its centre of mass is the first joint."""
TOOL_MOMENT: Annotated[float, Given("kg m^2", OURS)] = 80.0
"""Moment of inertia about the first joint."""
TOOL_FRICTION: Annotated[float, Given("1", OURS)] = 1.0
"""Friction of the links' surface; pymunk multiplies the two friction coefficients of a contact."""

HAND_FORCE: Annotated[float, Given("N", OURS)] = 600.0
"""Largest force of the hand: an unstoppable tool would shoot balls out of the pile."""
HAND_TORQUE: Annotated[float, Given("N m", OURS)] = 2400.0
"""Largest torque of the hand."""
MAX_SPEED: Annotated[float, Given("m/s", OURS)] = 1.5
"""Largest speed of the first joint along each axis: leaving the pile takes about 18 of the 30 steps."""
MAX_ACCELERATION: Annotated[float, Given("m/s^2", OURS)] = 3.0
"""Largest acceleration of the hand along each axis: balls can hardly be shaken off."""
MAX_TURN: Annotated[float, Given("rad/s", OURS)] = 0.3
"""Largest angular velocity of the tool."""
MAX_TILT: Annotated[float, Given("rad", OURS)] = 0.1
"""Largest tilt of the tool from its start: too little to make balls slide."""

NUM_BALLS: Annotated[int, Given("balls", TEXT)] = 40
"""Number of balls in the reservoir."""
BALL_RADIUS: Annotated[float, Given("m", OURS)] = 0.6
"""Radius of a ball."""
BALL_DENSITY: Annotated[float, Given("kg/m^2", "scale of the first author's early scenes")] = 1.0
"""Density of a ball."""
BALL_MASS = float(np.pi * BALL_RADIUS**2) * BALL_DENSITY
BALL_FRICTION: Annotated[float, Given("1", OURS)] = 0.2
"""Friction of the balls' surface. Balls do not rotate, so they never roll: they rest on slopes of up to 11 degrees."""
WALL_FRICTION: Annotated[float, Given("1", OURS)] = 0.5
"""Friction of floor and walls."""
GRAVITY: Annotated[float, Given("m/s^2", OURS)] = 10.0
"""Of the scene."""
DAMPING: Annotated[float, Given("1", OURS)] = 0.5
"""Fraction of its velocity that a body keeps over 1 s; nothing falls faster than gravity / ln 2 = 14.4 m/s."""

CLEARANCE: Annotated[float, Given("m", OURS)] = 2.0 * BALL_RADIUS + LINK_HALF_WIDTH + 0.08
"""Distance of every joint and end of the tool from floor and walls: a ball fits in between."""
FLOOR: Annotated[float, Given("m", OURS)] = float(TOOL_START[1]) - CLEARANCE
"""y of the floor: tools start at their lowest allowed position."""
RESERVOIR: Annotated[tuple[float, float], Given("m", OURS)] = (9.5, 24.0)
"""x of the reservoir's walls: the widest tool fits at every start."""
RIM: Annotated[float, Given("m", OURS)] = 14.0
"""y of the upper ends of these walls: above the piles, which are about 4.8 m deep."""
YARD: Annotated[tuple[float, float], Given("m", OURS)] = (6.0, 27.5)
"""x of the outer walls, which keep spilled balls in the picture."""
WALL_HALF_WIDTH: Annotated[float, Given("m", OURS)] = 0.5
"""Half the thickness of floor and walls."""
LINE: Annotated[float, Given("m", OURS)] = 15.0
"""A ball whose centre is above this y is out of the reservoir: 1 m above the rim."""
CLEAR: Annotated[float, Given("m", OURS)] = LINE - BALL_RADIUS - LINK_HALF_WIDTH
"""A tool whose lowest point is above this y is clear: every ball that rests on it is out."""
CEILING: Annotated[float, Given("m", OURS)] = CLEAR + 0.5
"""Largest y of the tool's lowest point."""

GOAL_NUMBERS: Annotated[tuple[int, int], Given("balls", TEXT)] = (1, 7)
"""Smallest and largest requested number of balls."""
REST_SPEED: Annotated[float, Given("m/s", OURS)] = 0.3
"""A ball on the tool is at rest if it is slower than this relative to the tool."""
HELD_STEPS: Annotated[int, Given("control steps", OURS)] = 3
"""Consecutive control steps for which the requested number must be held at rest."""
NUMBER_EXPONENT: Annotated[float, Given("1", OURS)] = 1.5
"""Exponent of progress: how strongly it prefers the requested number."""
SLACK_REWARD: Annotated[float, Given("1", PAPER, "slack_reward")] = -0.001
"""Added in every control step."""
SUCCESS_REWARD: Annotated[float, Given("1", "ours; the paper lists one for its 3D tasks only")] = 1.0
"""Added once, when the requested number is held."""

NUM_PILES: Annotated[int, Given("piles", OURS)] = 32
"""Number of different piles."""
PILE_SEED: Annotated[int, Given("1", OURS)] = 40
"""Seed of the positions from which balls fall into the piles."""
PILE_STEPS: Annotated[int, Given("physics steps", OURS)] = 240
"""Physics steps in which a pile comes to rest."""
HEAP_COLUMNS = np.linspace(RESERVOIR[0] + BALL_RADIUS, RESERVOIR[1] - BALL_RADIUS, 11)
"""x of the columns for balls that make room for the tool, m (ours): balls in adjacent columns do not touch."""
GAP: Annotated[float, Given("m", OURS)] = 0.02
"""Smallest gap between balls that make room and those below, and between any ball and the tool at the start."""

HORIZON: Annotated[int, Given("control steps", PAPER, "max_episode_steps")] = 30
"""Time limit."""
STEPS_PER_CONTROL: Annotated[int, Given("physics steps", PAPER, "control_steps_per_action")] = 5
"""In a control step."""
PHYSICS_PERIOD: Annotated[float, Given("s", OURS)] = 1.0 / 30.0
"""Of a physics step."""
CLOCK = Clock(STEPS_PER_CONTROL, PHYSICS_PERIOD)
ITERATIONS: Annotated[int, Given("1", OURS)] = 8
"""Of the contact solver in every physics step."""
MAX_BALL_SPEED: Annotated[float, Given("m/s", OURS)] = 12.0
"""Bound on the speed of balls; bounds overlaps, too, by the distance in a physics step. A million random control steps
saw 10.3 m/s and 0.35 m."""
SLOP: Annotated[float, Given("m", OURS)] = 0.02
"""Overlap of two bodies that the contact solver does not correct."""

PROFILE_POINTS: Annotated[int, Given("1", OURS)] = 24
"""At so many places the policies see how high the balls lie."""
PROFILE_STEP: Annotated[float, Given("m", OURS)] = BALL_RADIUS
"""Between neighbouring places: every ball lies over two of them."""
PROFILE_START: Annotated[float, Given("m", OURS)] = -5.4
"""x of the first place, from the first joint; the last one lies right of every tool's tip."""


CONTROL = Box.of(
    velocity_x=(-MAX_SPEED, MAX_SPEED, "m/s"),
    velocity_y=(-MAX_SPEED, MAX_SPEED, "m/s"),
    angular_velocity=(-MAX_TURN, MAX_TURN, "rad/s"),
)
MOVE, MOVE_UP = CONTROL.slice("velocity_x", "velocity_y"), CONTROL.index("velocity_y")
TURN = CONTROL.index("angular_velocity")
INSTANCE = Box.of(
    wanted=(*GOAL_NUMBERS, "balls"), pile=(0, NUM_PILES - 1, ""), start_shift=(-START_SHIFT, START_SHIFT, "m")
)
WANTED, PILE, SHIFT = INSTANCE.index("wanted"), INSTANCE.index("pile"), INSTANCE.index("start_shift")
STATE = Box.of(
    joint_1_x=(0.0, 40.0, "m"),
    joint_1_y=(0.0, 40.0, "m"),
    tilt=(-1.0, 1.0, "rad"),
    lowest_y=(0.0, 40.0, "m"),
    velocity_x=(-20.0, 20.0, "m/s"),
    velocity_y=(-20.0, 20.0, "m/s"),
    angular_velocity=(-10.0, 10.0, "rad/s"),
    held=(0.0, NUM_BALLS, "balls"),
    held_less_wanted=(-NUM_BALLS, NUM_BALLS, "balls"),
    held_steps=(0.0, HELD_STEPS, "steps"),
    joint_1_to_joint_2_x=(-10.0, 10.0, "m"),
    joint_1_to_joint_2_y=(-10.0, 10.0, "m"),
    joint_1_to_tip_x=(-10.0, 10.0, "m"),
    joint_1_to_tip_y=(-10.0, 10.0, "m"),
    **{f"wants_{number}": (0.0, 1.0, "") for number in range(GOAL_NUMBERS[0], GOAL_NUMBERS[1] + 1)},
    **{f"surface_{place}": (FLOOR, 25.0, "m") for place in range(1, PROFILE_POINTS + 1)},
    **{f"rise_{place}": (-MAX_BALL_SPEED, MAX_BALL_SPEED, "m/s") for place in range(1, PROFILE_POINTS + 1)},
)
JOINT, JOINT_VELOCITY = STATE.slice("joint_1_x", "joint_1_y"), STATE.slice("velocity_x", "velocity_y")
TILT, ANGULAR_VELOCITY, LOWEST = STATE.index("tilt"), STATE.index("angular_velocity"), STATE.index("lowest_y")
HELD, HELD_LESS_WANTED, HELD_FOR = (STATE.index(name) for name in ("held", "held_less_wanted", "held_steps"))
SHAPE, WANTS = STATE.group("joint_1_to_"), STATE.group("wants_")
SURFACE, RISE = STATE.group("surface_"), STATE.group("rise_")
PROFILE_X = PROFILE_START + PROFILE_STEP * np.arange(PROFILE_POINTS)
"""(M,) where the profile is taken, from the first joint, m."""

BALL_BODIES, TOOL_BODY = slice(0, NUM_BALLS), NUM_BALLS
"""Rows of `PlanarSimulator.bodies`; the position of a tool is that of its first joint."""


class Scoop(Task):
    """Scoop a wanted number of balls out of a reservoir (paper, appendix "Environment Details").

    Seen from the side, a robot holds a ladle, a chain of three links: a handle and two more that curl up behind it. The
    ladle starts inside the pile. The hand moves it gently and tilts it a little, with limited force. It can hardly
    shake or pour balls off, and the observation counts them only once they are out. So the number of balls that stay on
    the tool is decided by its shape and by the pile: a deep or long ladle for many, a short one for few.

    Action space
        Design, 5: lengths of the three links (m) and the two angles between them (rad) (paper). Control, 3: velocity of
        the first joint along x and y (m/s) and angular velocity (rad/s) (ours). Acceleration and tilt are limited, and
        the tool keeps away from floor and walls (ours).

    Observation
        State, 69: position of the first joint (m), tilt (rad), height of the tool's lowest point (m), velocity
        (m/s) and angular velocity (rad/s); number of balls held out of the reservoir, the same minus the
        requested number, control steps for which success has held; the displacements from the first joint to
        the second and to the tip (m); a one-hot code of the requested number; and the balls, as a profile of
        the pile: how high the topmost ball reaches (m) at evenly spaced x that move with the first joint, and
        how fast this ball rises (m/s). Goal, 1: the requested number. Then the design and the phase.

        The paper's policies observe positions and velocities of the balls; the profile is our form of them. It does not
        depend on the balls' order, is short, and shows the designer the pile around the place of the tool, before there
        is one. Sorted positions and velocities are more than three times as long, tell hardly more of how many balls a
        tool will bring, and jump where two balls change places in the order; the nearest balls change places as well.

    Design space
        Length = initial length (1 + ratio), angle = scale * ratio (our reading of the paper's table). The table has
        three angles; a chain of three links has two joints, and the third angle is not used.

    Goal space
        Integer numbers of balls (paper), with equal probability (ours). An instance also holds which pile there
        is and how far to the left or right the tool starts; these are no part of the goal, but the state shows
        them.

    Reward
        The change of a potential, plus the paper's slack (negative) and a bonus on success. The potential increases as
        the tool is lifted, and is larger the nearer the number of balls above it is to the requested one. Lowering the
        tool loses what lifting it earned. An episode's return is below 2.

    Starting state
        A pile nearly at rest and the tool upright in it, at the paper's position (our reading). Balls that would
        overlap the tool are put on top of the pile and settle within the first second (ours).

    Episode end
        Success when the tool is clear of the reservoir and the requested number of balls has been at rest on it for a
        few control steps, or the time limit.
    """

    name = "scoop"
    version = 2
    title = "Scoop"
    scene: ClassVar = constants(__name__)
    horizon = HORIZON
    max_slots = 28  # physics costs far more than a call of the policy: as fast as 100, and work for more cores
    control_period = CLOCK.control_period
    design_space = chain_design_space(LENGTH_INIT, LENGTH_RATIO, ANGLE_SCALE, ANGLE_RATIO)
    tool_graph = CHAIN_GRAPH
    control_space = CONTROL
    instance_space = INSTANCE
    goal_size = 1
    state_space = STATE
    reward_terms: ClassVar = {
        "progress": f"change of h (min(1 + k, 1 + n) / max(1 + k, 1 + n))^{NUMBER_EXPONENT:g}, h the share of the way "
        f"from y = {TOOL_START[1]:g} m to {CEILING:g} m by which the tool's lowest point has been lifted, k the number "
        "of balls vertically above the tool, n the wanted number",
        "slack": f"{SLACK_REWARD:g}",
        "success": f"{SUCCESS_REWARD:g} in the step that solves the task",
    }
    success_conditions: ClassVar = {
        "clear": f"the tool's lowest point is above y = {CLEAR:g} m, so that what rests on it is out of the reservoir",
        "wanted_number": "as many balls as wanted are vertically above the tool",
        "at_rest": f"all of them are slower than {REST_SPEED:g} m/s relative to the tool",
    }
    success_steps = HELD_STEPS

    run_settings: ClassVar[ByProfile] = {
        "quick": {"steps": 260_000},
        "laptop": {"steps": 600_000},
        "workstation": {"steps": 1_000_000},
    }
    outcome = Quantity("balls held out of the reservoir", "balls")
    soundness = Soundness(overlap=MAX_BALL_SPEED * CLOCK.period, speed=MAX_BALL_SPEED, outcome_change=0.3, chaotic=True)

    def sample_instances(self, rng: np.random.Generator, count: int) -> Floats:
        """Return (count, I) instances with number, pile and shift drawn uniformly."""
        instances = np.zeros((count, INSTANCE.size))
        instances[:, WANTED] = rng.integers(GOAL_NUMBERS[0], GOAL_NUMBERS[1] + 1, size=count)
        instances[:, PILE] = rng.integers(NUM_PILES, size=count)
        instances[:, SHIFT] = rng.uniform(-START_SHIFT, START_SHIFT, size=count)
        return instances

    def material(self, designs: Floats) -> Floats:
        """Return the total link length as a fraction of the largest, for designs (b, D) in their units."""
        return chain_material(designs, self.design_space)

    def effort(self, controls: Floats) -> Floats:
        """Return the norm of the normalised velocities as a fraction of the largest, for controls (b, C) in [-1, 1]."""
        speed: Floats = np.linalg.norm(controls, axis=1) / np.sqrt(controls.shape[1])
        return speed

    def tool_parts(self, design: Floats) -> tuple[ToolPart, ...]:
        """Return the links of the tool of a design (D,) in its units; it is held, and turned, at the first joint."""
        points = chain_points(design[None], FIRST_LINK_ANGLE)[0]
        return chain_parts(points - points[1], LINK_HALF_WIDTH)

    def script(self) -> Behaviour:
        """Return a script that designs a ladle for every number and lifts any tool straight up."""
        from ._scripts.scoop import ScoopScript  # imported here because that file imports this one

        return ScoopScript(self)

    def make_simulator(self, num_slots: int, refinement: int = 1) -> Simulator:
        """Return a simulator of `num_slots` piles and tools."""
        return _ScoopSimulator(num_slots, self.state_space.size, CLOCK.refined(refinement))


class _ScoopSimulator(PlanarSimulator):
    """A pile of balls in a reservoir and a tool moved by a hand with limited force, one of each per slot."""

    view = View(x=(YARD[0] - 1.0, YARD[1] + 1.0), y=(FLOOR - 0.6, 24.0))

    def __init__(self, num_slots: int, state_size: int, clock: Clock) -> None:
        super().__init__(num_slots, state_size, num_bodies=NUM_BALLS + 1, clock=clock)
        self.wanted = np.ones(num_slots)
        self.chain = np.zeros((num_slots, 4, 2))
        """(B, 4, 2) points of the upright tool relative to its first joint, m."""
        self.tilt, self.spin = np.zeros(num_slots), np.zeros(num_slots)
        """(B,) angle, rad, and angular velocity, rad/s, of the tools."""
        self.lowest = np.zeros(num_slots)
        """(B,) y of the tool's lowest point, m."""
        self.hand_velocity = np.zeros((num_slots, 2))
        """(B, 2) velocities of the hands in the last control step, m/s."""
        self.progress = np.zeros(num_slots)
        self.balls: list[Balls | None] = [None] * num_slots
        self.tools: list[pymunk.Body | None] = [None] * num_slots
        self.hands: list[pymunk.Body | None] = [None] * num_slots

    def begin(self, slots: Slots, instances: Floats) -> None:
        """Put the piles of `instances` (b, I) into the reservoirs."""
        self.forget(slots)
        wanted, pile = (np.rint(instances[:, entry]).astype(int) for entry in (WANTED, PILE))
        self.wanted[slots] = wanted
        self.bodies[slots] = 0.0
        self.bodies[slots, BALL_BODIES, PLACE] = settled_piles()[pile]
        self.bodies[slots, TOOL_BODY, PLACE] = TOOL_START
        self.bodies[slots, TOOL_BODY, 0] += instances[:, SHIFT]
        self.chain[slots] = 0.0
        for values in (self.tilt, self.spin, self.hand_velocity, self.progress):
            values[slots] = 0.0
        self.lowest[slots] = TOOL_START[1]
        self._write_state(slots, self.chain[slots])

    def build(self, slots: Slots, designs: Floats) -> None:
        """Put the tools of `designs` (b, D) into the piles."""
        points = chain_points(designs, FIRST_LINK_ANGLE)
        chain = points - points[:, 1:2]
        self.chain[slots] = chain
        self.bodies[slots, TOOL_BODY, 1] = TOOL_START[1] - chain[..., 1].min(axis=1)
        places = chain + self.bodies[slots, TOOL_BODY, None, PLACE]
        for slot, tool in zip(slots.tolist(), places, strict=True):
            self.bodies[slot, BALL_BODIES, PLACE] = make_room(self.bodies[slot, BALL_BODIES, PLACE], tool)
        self.add_spaces(slots, chain)
        self._look(slots)

    def build_space(self, slot: int, points: Floats) -> pymunk.Space:
        """Return the scene of one episode: reservoir, balls, tool, and the hand that moves it."""
        space, balls = empty_reservoir(), self.balls[slot]
        if balls is None:
            balls = self.balls[slot] = Balls.new()
            balls.move(None, space, self.bodies[slot, BALL_BODIES, PLACE])
        else:
            balls.move(self.spaces[slot], space, self.bodies[slot, BALL_BODIES, PLACE])
        tool = pymunk.Body(TOOL_MASS, TOOL_MOMENT)
        tool.position = tuple(self.bodies[slot, TOOL_BODY, PLACE].tolist())
        links = [pymunk.Segment(tool, tuple(a), tuple(b), LINK_HALF_WIDTH) for a, b in pairwise(points.tolist())]
        for link in links:
            link.friction = TOOL_FRICTION
            link.colour = COLOURS["tool"]
        # Joints with limited force transmit the hand's velocity to the tool. Without bias they do not correct a lag in
        # position: a tool that was held back would otherwise shoot forward once it is free.
        hand = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        grip, wrist = pymunk.PivotJoint(hand, tool, (0.0, 0.0), (0.0, 0.0)), pymunk.GearJoint(hand, tool, 0.0, 1.0)
        grip.max_bias = wrist.max_bias = 0.0
        grip.max_force, wrist.max_force = HAND_FORCE, HAND_TORQUE
        space.add(tool, *links, hand, grip, wrist)
        self.tools[slot], self.hands[slot] = tool, hand
        return space

    def step(self, slots: Slots, controls: Floats) -> None:
        """Move the hands by `controls` (b, C) for one control step and reward lifted balls."""
        velocity, turn = self._allowed(slots, controls)
        for slot, pair, spin in zip(slots.tolist(), velocity.tolist(), turn.tolist(), strict=True):
            hand = self.hands[slot]
            assert hand is not None, "a tool is built before it is moved"
            hand.velocity = tuple(pair)
            hand.angular_velocity = spin
        self.advance(slots)
        self.read_bodies(slots)
        tools = [tool for slot in slots.tolist() if (tool := self.tools[slot]) is not None]
        self.tilt[slots] = [tool.angle for tool in tools]
        self.spin[slots] = [tool.angular_velocity for tool in tools]
        before = self.progress[slots]
        self._look(slots)
        self.set_reward(
            slots,
            progress=self.progress[slots] - before,
            slack=SLACK_REWARD,
            success=SUCCESS_REWARD * self.success[slots],
        )

    def inspect(self, slot: int) -> Physics:
        """Return the balls' deepest overlap, their highest speed, and whether all are inside the outer walls."""
        space = self.spaces[slot]
        balls = [shape for shape in space.shapes if isinstance(shape, pymunk.Circle)]
        places = self.bodies[slot, BALL_BODIES, PLACE]
        inside = (places[:, 0] > YARD[0]) & (places[:, 0] < YARD[1]) & (places[:, 1] > FLOOR)
        return Physics(
            overlap=max(overlap(space, ball) for ball in balls),
            speed=float(np.linalg.norm(self.bodies[slot, BALL_BODIES, VELOCITY], axis=1).max()),
            contained=bool(inside.all()),
        )

    def mark(self, slot: int, canvas: Canvas) -> None:
        """Draw the height above which a ball is out of the reservoir."""
        canvas.segment((YARD[0], LINE), (YARD[1], LINE), 0.0, COLOURS["goal"])

    def _allowed(self, slots: Slots, controls: Floats) -> tuple[Floats, Floats]:
        """Return velocity (b, 2) and angular velocity (b,) for `controls` (b, C), within the limits of the tools."""
        period = self.clock.control_period
        tilt = self.tilt[slots]
        next_tilt = np.clip(tilt + controls[:, TURN] * (MAX_TURN * period), -MAX_TILT, MAX_TILT)
        points = rotated(self.chain[slots], next_tilt)
        low, high = points.min(axis=1), points.max(axis=1)
        least = np.array([RESERVOIR[0] + CLEARANCE, TOOL_START[1]]) - low
        most = np.stack([RESERVOIR[1] - CLEARANCE - high[:, 0], CEILING - low[:, 1]], axis=1)
        middle = 0.5 * (least + most)  # for tools that became too wide for both clearances by tilting
        joint, change = self.bodies[slots, TOOL_BODY, PLACE], MAX_ACCELERATION * period
        before = self.hand_velocity[slots]
        wish = joint + np.clip(controls[:, MOVE] * MAX_SPEED, before - change, before + change) * period
        target = np.clip(wish, np.minimum(least, middle), np.maximum(most, middle))
        velocity: Floats = np.clip((target - joint) / period, -MAX_SPEED, MAX_SPEED)
        self.hand_velocity[slots] = velocity
        turn: Floats = np.clip((next_tilt - tilt) / period, -MAX_TURN, MAX_TURN)
        return velocity, turn

    def _look(self, slots: Slots) -> None:
        """Count balls, determine success and progress, and write the state."""
        balls, tool = self.bodies[slots, BALL_BODIES], self.bodies[slots, TOOL_BODY]
        wanted, chain = self.wanted[slots], rotated(self.chain[slots], self.tilt[slots])
        self.lowest[slots] = lowest = tool[:, 1] + chain[..., 1].min(axis=1)
        from_tool = balls - tool[:, None]
        loaded = above(from_tool[..., PLACE], chain)
        number = loaded.sum(axis=1)
        clear = lowest > CLEAR
        self.outcome[slots] = np.where(clear, number, 0)
        moving = (from_tool[..., VELOCITY] ** 2).sum(axis=2) > REST_SPEED**2
        at_rest = ~(loaded & moving).any(axis=1)
        self.set_success(slots, HELD_STEPS, clear=clear, wanted_number=number == wanted, at_rest=at_rest)
        lift = np.clip((lowest - TOOL_START[1]) / (CEILING - TOOL_START[1]), 0.0, 1.0)
        # The ratio is lower for one ball too few than for one too many, and for an error of one in 2 than in 7. One is
        # added to both numbers, so that the first ball does not start from 0.
        ratio = (1.0 + np.minimum(number, wanted)) / (1.0 + np.maximum(number, wanted))
        self.progress[slots] = lift * ratio**NUMBER_EXPONENT
        self._write_state(slots, chain)

    def _write_state(self, slots: Slots, chain: Floats) -> None:
        tool, wanted = self.bodies[slots, TOOL_BODY], self.wanted[slots]
        state = np.empty((len(slots), STATE.size))
        state[:, JOINT], state[:, JOINT_VELOCITY] = tool[:, PLACE], tool[:, VELOCITY]
        state[:, TILT], state[:, ANGULAR_VELOCITY] = self.tilt[slots], self.spin[slots]
        state[:, LOWEST] = self.lowest[slots]
        state[:, HELD], state[:, HELD_LESS_WANTED] = self.outcome[slots], self.outcome[slots] - wanted
        state[:, HELD_FOR] = self.met_steps[slots]
        state[:, SHAPE] = chain[:, 2:].reshape(len(slots), -1)
        state[:, WANTS] = wanted[:, None] == np.arange(GOAL_NUMBERS[0], GOAL_NUMBERS[1] + 1)
        state[:, SURFACE], state[:, RISE] = profile(self.bodies[slots, BALL_BODIES], tool[:, 0])
        self.state[slots] = state


def empty_reservoir() -> pymunk.Space:
    """Return a space with gravity, floor and walls; inner faces are at `FLOOR`, `RESERVOIR` and `YARD`."""
    space = pymunk.Space()
    space.gravity = (0.0, -GRAVITY)
    space.damping = DAMPING
    space.iterations = ITERATIONS
    space.collision_slop = SLOP
    half, top = WALL_HALF_WIDTH, CEILING + 10.0
    ends = [((YARD[0], FLOOR - half), (YARD[1], FLOOR - half))]
    ends += [((x, FLOOR), (x, RIM - half)) for x in (RESERVOIR[0] - half, RESERVOIR[1] + half)]
    ends += [((x, FLOOR), (x, top)) for x in (YARD[0] - half, YARD[1] + half)]
    walls = [pymunk.Segment(space.static_body, *pair, half) for pair in ends]
    for wall in walls:
        wall.friction = WALL_FRICTION
    space.add(*walls)
    return space


@dataclass(frozen=True)
class Balls:
    """Balls that are moved from one episode's space to the next, in half the time of creating new ones."""

    bodies: list[pymunk.Body]
    discs: list[pymunk.Circle]

    @classmethod
    def new(cls, radius: float = BALL_RADIUS) -> Balls:
        """Create balls of `radius`, m, that are not in a space."""
        bodies = [pymunk.Body(BALL_MASS, float("inf")) for _ in range(NUM_BALLS)]
        discs = [pymunk.Circle(body, radius) for body in bodies]
        for disc in discs:
            disc.friction = BALL_FRICTION
        return cls(bodies, discs)

    def move(self, before: pymunk.Space | None, after: pymunk.Space, places: Floats) -> None:
        """Move the balls from one space to another, at rest at `places` (N, 2).

        A step without shapes in between uses up the overlap corrections that pymunk keeps for the next step, so that no
        state of the last episode remains.
        """
        if before is not None:
            before.remove(*self.bodies, *self.discs)
        after.add(*self.bodies)
        after.step(CLOCK.period)
        for body, place in zip(self.bodies, places.tolist(), strict=True):
            body.position = tuple(place)
            body.velocity = (0.0, 0.0)
        after.add(*self.discs)


@cache
def settled_piles() -> Floats:
    """Return the balls' positions in all piles, (P, N, 2), m, after they were dropped row by row and came to rest.

    They settle as slightly larger balls, so that the balls of an episode do not overlap at its start; the pile then
    settles a little further.
    """
    rng = np.random.default_rng(PILE_SEED)
    row, column = np.divmod(np.arange(NUM_BALLS), 8)
    width = (RESERVOIR[1] - RESERVOIR[0]) / 8.0
    jitter = rng.uniform(-1.0, 1.0, size=(NUM_PILES, NUM_BALLS)) * (0.5 * width - BALL_RADIUS - 2.0 * SLOP)
    result = np.empty((NUM_PILES, NUM_BALLS, 2))
    for pile in range(NUM_PILES):
        x, y = RESERVOIR[0] + (column + 0.5) * width + jitter[pile], FLOOR + (2.1 * row + 1.0) * BALL_RADIUS
        space = empty_reservoir()
        balls = Balls.new(BALL_RADIUS + 1.5 * SLOP)
        balls.move(None, space, np.stack([x, y], axis=1))
        for _ in range(PILE_STEPS):
            space.step(CLOCK.period)
        result[pile] = [body.position for body in balls.bodies]
    result.flags.writeable = False  # shared by all simulators
    return result


def make_room(balls: Floats, tool: Floats) -> Floats:
    """Return `balls` (N, 2) after moving those that overlap the tool with points `tool` (4, 2) to the top of the pile.

    They are put in columns, lowest positions first, at rest and clear of the tool and of each other.
    """
    clear = BALL_RADIUS + LINK_HALF_WIDTH + GAP
    moved = distances(balls, tool) < clear
    rest = balls[~moved]
    # A ball in a column touches a ball of the pile where their centres are two radii apart: the height follows from
    # Pythagoras. Balls further than two radii from the column do not matter, and an empty column starts at the floor.
    square = (2.0 * BALL_RADIUS) ** 2 - (HEAP_COLUMNS[:, None] - rest[:, 0]) ** 2
    touching = np.where(square > 0.0, rest[:, 1] + np.sqrt(np.maximum(square, 0.0)), FLOOR + BALL_RADIUS)
    layers = (2.0 * BALL_RADIUS + GAP) * np.arange(4)[:, None] + GAP
    heights = touching.max(axis=1) + layers
    heap = np.stack([np.broadcast_to(HEAP_COLUMNS, heights.shape), heights], axis=-1).reshape(-1, 2)
    free = heap[distances(heap, tool) > clear]
    lowest = np.argsort(free[:, 1], kind="stable")
    result = balls.copy()
    result[moved] = free[lowest[: int(moved.sum())]]
    return result


def distances(places: Floats, tool: Floats) -> Floats:
    """Return the distances (N,) of `places` (N, 2) from the middle line of a chain with points `tool` (4, 2)."""
    start, link = tool[:-1], tool[1:] - tool[:-1]
    offset = places[:, None] - start
    # Projection on each link's line, clipped to the link itself: the nearest point of a segment.
    share = np.clip((offset * link).sum(axis=2) / (link * link).sum(axis=1), 0.0, 1.0)
    nearest: Floats = ((offset - share[..., None] * link) ** 2).sum(axis=2).min(axis=1)
    return np.sqrt(nearest)


def above(places: Floats, chains: Floats) -> Booleans:
    """Return which `places` (b, N, 2) are vertically above a link of the chains with points (b, 4, 2)."""
    start, link = chains[:, None, :-1], np.diff(chains, axis=1)[:, None]
    offset = places[:, :, None] - start
    wide = np.abs(link[..., 0]) > 1e-9
    share = np.where(wide, offset[..., 0] / np.where(wide, link[..., 0], 1.0), -1.0)
    over = (share > 0.0) & (share < 1.0) & (offset[..., 1] > share * link[..., 1])
    result: Booleans = np.any(over, axis=2)
    return result


def profile(balls: Floats, middles: Floats) -> tuple[Floats, Floats]:
    """Return how high the topmost of `balls` (b, N, 4) reaches around the x `middles` (b,), and how fast it rises.

    Both are (b, M), at `PROFILE_X` from there, in m and m/s; where there is no ball, the floor, at rest.
    """
    along = (balls[..., 0] - middles[:, None] - PROFILE_START) / PROFILE_STEP
    place = np.floor(along)[..., None] + (0.0, 1.0)  # A ball lies over the two places next to its middle.
    square = BALL_RADIUS**2 - (PROFILE_STEP * (place - along[..., None])) ** 2
    height = balls[..., 1, None] + np.sqrt(np.maximum(square, 0.0))
    width = PROFILE_POINTS + 2  # Two more take the balls that lie beyond.
    row = width * np.arange(len(balls))[:, None, None]
    entry = row + np.clip(place, -1.0, PROFILE_POINTS).astype(np.intp) + 1
    surface, rise = np.full(len(balls) * width, FLOOR), np.zeros(len(balls) * width)
    np.maximum.at(surface, entry.ravel(), height.ravel())
    topmost = height == surface[entry]
    rise[entry[topmost]] = np.broadcast_to(balls[..., 3, None], entry.shape)[topmost]
    return surface.reshape(-1, width)[:, 1:-1], rise.reshape(-1, width)[:, 1:-1]


def rotated(points: Floats, angles: Floats) -> Floats:
    """Return `points` (b, 4, 2) rotated about the origin by `angles` (b,), rad."""
    cosine, sine = np.cos(angles)[:, None], np.sin(angles)[:, None]
    x, y = points[..., 0], points[..., 1]
    return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)
