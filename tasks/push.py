"""Push: a held chain of links pushes or pulls a puck until it stops at the goal. Docstring of `Push` has the details.

Shapes: `b` slots a call names, `I` = 2 instance (goal x, y), `D` = 5 design, `C` = 2 control.
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
from ._scene import nearest_clear_shift

PAPER = "paper, table of push"
EARLY = "scale of the first author's early scenes"

TOOL_START: Annotated[Floats, Given("m", PAPER, "tool_position_init")] = np.array([20.0, 10.0])
"""Where the held end starts."""
START_CLEARANCE: Annotated[float, Given("m", OURS)] = 0.25
"""A tool that would start closer to the puck than this starts left or right of there, whichever is nearer."""
LENGTH_INIT: Annotated[tuple[float, float, float], Given("m", PAPER, "tool_length_init")] = (2.0, 2.0, 2.0)
"""Of the links, from which the design space is made: length = initial length (1 + ratio)."""
LENGTH_RATIO: Annotated[tuple[float, float], Given("1", PAPER, "tool_length_ratio")] = (-0.5, 0.5)
"""Range of a length's ratio."""
ANGLE_SCALE: Annotated[float, Given("degrees", PAPER, "tool_angle_scale")] = 90.0
"""Angle of ratio 1: angle = scale * ratio."""
ANGLE_RATIO: Annotated[tuple[float, float], Given("1", PAPER, "tool_angle_ratio")] = (-1.0, 1.0)
"""Range of an angle's ratio."""
FIRST_LINK_ANGLE: Annotated[float, Given("rad", OURS)] = np.pi
"""The first link points left and passes above the puck."""
WORKSPACE: Annotated[Box, Given("m", OURS)] = Box.of(base_x=(14.0, 24.0, "m"), base_y=(6.5, 10.5, "m"))
"""Where the held end may go: too low a place to lift a deep hook over the puck and use it on the other side."""
MAX_SPEED: Annotated[float, Given("m/s", OURS)] = 6.0
"""Largest speed of the held end along each axis: a tenth of the puck's radius in a physics step."""

PUCK_START: Annotated[Floats, Given("m", OURS)] = np.array([16.0, 8.25])
"""Where the puck starts, at rest."""
PUCK_RADIUS: Annotated[float, Given("m", EARLY)] = 1.0
"""Of the puck."""
PUCK_DENSITY: Annotated[float, Given("kg/m^2", EARLY)] = 1.0
"""Of the puck."""
PUCK_DECELERATION: Annotated[float, Given("m/s^2", OURS)] = 12.0
"""Friction of the table slows a sliding puck down at this rate: from full tool speed to rest within 1.5 m."""
CONTACT_FRICTION: Annotated[float, Given("1", EARLY)] = 0.3
"""Between link and puck."""

GOAL_DISTANCE: Annotated[tuple[float, float], Given("m", OURS)] = (3.0, 5.0)
"""Smallest and largest distance of a goal from the puck's start."""
GOAL_RADIUS: Annotated[float, Given("m", EARLY)] = 1.5
"""The puck's centre must stop within this distance of the goal."""
REST_SPEED: Annotated[float, Given("m/s", OURS)] = 0.2
"""A puck slower than this is at rest."""
REST_STEPS: Annotated[int, Given("control steps", OURS)] = 3
"""How long the puck must rest at the goal."""
SLACK_REWARD: Annotated[float, Given("1", PAPER, "slack_reward")] = -0.001
"""Added in every control step."""
SUCCESS_REWARD: Annotated[float, Given("1", "ours; the paper lists one for its 3D tasks only")] = 1.0
"""Added once, when the puck rests at the goal."""

HORIZON: Annotated[int, Given("control steps", PAPER, "max_episode_steps")] = 150
"""Time limit."""
STEPS_PER_CONTROL: Annotated[int, Given("physics steps", OURS, "control_steps_per_action")] = 2
"""In a control step."""
PHYSICS_PERIOD: Annotated[float, Given("s", EARLY)] = 1.0 / 60.0
"""Of a physics step."""
CLOCK = Clock(STEPS_PER_CONTROL, PHYSICS_PERIOD)


STATE = Box.of(
    puck_x=(-6.0, 30.0, "m"),
    puck_y=(-6.0, 30.0, "m"),
    puck_velocity_x=(-20.0, 20.0, "m/s"),
    puck_velocity_y=(-20.0, 20.0, "m/s"),
    base_x=(WORKSPACE.low[0], WORKSPACE.high[0], "m"),
    base_y=(WORKSPACE.low[1], WORKSPACE.high[1], "m"),
    puck_to_goal_x=(-25.0, 25.0, "m"),
    puck_to_goal_y=(-25.0, 25.0, "m"),
    base_to_puck_x=(-25.0, 25.0, "m"),
    base_to_puck_y=(-25.0, 25.0, "m"),
)
PUCK, PUCK_VELOCITY = STATE.slice("puck_x", "puck_y"), STATE.slice("puck_velocity_x", "puck_velocity_y")
BASE, PUCK_TO_GOAL = STATE.slice("base_x", "base_y"), STATE.slice("puck_to_goal_x", "puck_to_goal_y")
BASE_TO_PUCK = STATE.slice("base_to_puck_x", "base_to_puck_y")

PUCK_BODY, TOOL_BODY = 0, 1
"""Rows of `PlanarSimulator.bodies`."""


class Push(Task):
    """Push a round puck with the tool such that it stops at the goal (paper, appendix "Environment Details").

    Seen from above, a robot holds the free end of a chain of three links and moves it without turning it. At the start
    the chain passes above the puck, and goals are all around it. A link pushes only away from itself, so the goal
    decides where a link must stand: above the puck for goals below, to its right for goals on the left, on its left, as
    a hook, for goals on the right, and beneath it for goals above. The held end stays in a box that is too low to lift
    a deep hook over the puck, so a tool that serves one side hardly serves the other.

    Action space
        Design, 5: lengths of the three links (m) and the two angles between them (rad) (paper). Control, 2: velocity of
        the held end along x and y (m/s) (ours).

    Observation
        State, 10: place and velocity of the puck, place of the held end, way from the puck to the goal and from the
        held end to the puck, x and y of each (m, m/s). Goal, 2: its place x, y (m). Then the design and the phase.

    Design space
        Length = initial length (1 + ratio), angle = scale * ratio (our reading of the paper's table). The table has
        three angles; a chain of three links has two joints, and the third angle is not used.

    Goal space
        Places in a ring around the puck's start, uniform in area, in every direction (ours).

    Reward
        The share of the way by which the puck came nearer to the goal, less the paper's slack, and a bonus on success.
        An episode's return is below 2.

    Starting state
        The puck at rest and the held end where the paper's table has it, the same for every goal. A tool that would
        then be on the puck starts at the nearest place to the left or right of there that is clear of it (ours).

    Episode end
        Success when the puck has come to rest at the goal, or the time limit.
    """

    name = "push"
    title = "Push"
    scene: ClassVar = {**CHAIN_SCENE, **constants(__name__)}
    horizon = HORIZON
    control_period = CLOCK.control_period
    design_space = chain_design_space(LENGTH_INIT, LENGTH_RATIO, ANGLE_SCALE, ANGLE_RATIO)
    tool_graph = CHAIN_GRAPH
    control_space = Box.of(velocity_x=(-MAX_SPEED, MAX_SPEED, "m/s"), velocity_y=(-MAX_SPEED, MAX_SPEED, "m/s"))
    instance_space = Box.of(
        goal_x=(PUCK_START[0] - GOAL_DISTANCE[1], PUCK_START[0] + GOAL_DISTANCE[1], "m"),
        goal_y=(PUCK_START[1] - GOAL_DISTANCE[1], PUCK_START[1] + GOAL_DISTANCE[1], "m"),
    )
    goal_size = 2
    position_entries = ("goal_x", "goal_y")
    state_space = STATE
    reward_terms: ClassVar = {
        "progress": "(d_before - d_after) / d_start, d the distance from puck to goal, m",
        "slack": f"{SLACK_REWARD:g}",
        "success": f"{SUCCESS_REWARD:g} in the step that solves the task",
    }
    success_conditions: ClassVar = {
        "at_goal": f"the puck's centre is within {GOAL_RADIUS:g} m of the goal",
        "at_rest": f"the puck is slower than {REST_SPEED:g} m/s",
    }
    success_steps = REST_STEPS

    outcome = Quantity("distance from puck to goal", "m")
    # A puck between two links at once leaves up to a fifth faster than they move, until the contact solver has both.
    soundness = Soundness(overlap=LINK_HALF_WIDTH, speed=1.25 * np.sqrt(2.0) * MAX_SPEED, outcome_change=0.1)

    def sample_instances(self, rng: np.random.Generator, count: int) -> Floats:
        """Return (count, I) goals, uniform in the area of the ring around the puck."""
        near, far = GOAL_DISTANCE
        distance = np.sqrt(rng.uniform(near**2, far**2, size=count))
        angle = rng.uniform(-np.pi, np.pi, size=count)
        return PUCK_START + distance[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)

    def in_region(self, instances: Floats) -> Booleans:
        """Return which goals (b, I) are in the ring around the puck."""
        near, far = GOAL_DISTANCE
        distance = np.linalg.norm(instances - PUCK_START, axis=1)
        inside: Booleans = (near <= distance) & (distance <= far)
        return inside

    def in_cutout(self, instances: Floats, fraction: float) -> Booleans:
        """Return which goals (b, I) are in the two patches, above and below the puck, that cover `fraction` of them.

        A patch is a sector of the ring, centred in angle and in area and scaled alike in both (ours, after the paper's
        two patches of fetch cube).
        """
        near, far = GOAL_DISTANCE
        offset = instances - PUCK_START
        area = ((offset**2).sum(axis=1) - near**2) / (far**2 - near**2)
        turn = np.abs(np.arctan2(offset[:, 1], offset[:, 0])) / np.pi
        reach = 0.5 * np.sqrt(fraction)
        result: Booleans = (np.abs(area - 0.5) < reach) & (np.abs(turn - 0.5) < reach)
        return result

    def material(self, designs: Floats) -> Floats:
        """Return the used share of the largest total link length for designs (b, D) in their units."""
        return chain_material(designs, self.design_space)

    def effort(self, controls: Floats) -> Floats:
        """Return the share of the largest speed of the held end for controls (b, C) in [-1, 1]."""
        speed: Floats = np.linalg.norm(controls, axis=1) / np.sqrt(controls.shape[1])
        return speed

    def tool_parts(self, design: Floats) -> tuple[ToolPart, ...]:
        """Return the links of the tool of a design (D,) in its units."""
        return chain_parts(chain_points(design[None], FIRST_LINK_ANGLE)[0], LINK_HALF_WIDTH)

    def script(self) -> Behaviour:
        """Return a script that pulls or pushes the puck with whichever part of a tool lies behind it."""
        from ._scripts.push import PushScript  # here, since that file reads this one

        return PushScript(self)

    def make_simulator(self, num_slots: int, refinement: int = 1) -> Simulator:
        """Return a simulator of `num_slots` pucks and tools."""
        return _PushSimulator(num_slots, self.state_space.size, CLOCK.refined(refinement))


class _PushSimulator(PlanarSimulator):
    """Puck on a table with dry friction and a kinematic tool, one pair per slot."""

    view = View(x=(4.0, 30.0), y=(-1.0, 17.0))

    def __init__(self, num_slots: int, state_size: int, clock: Clock) -> None:
        super().__init__(num_slots, state_size, num_bodies=2, clock=clock)
        self.goal = np.zeros((num_slots, 2))
        self.start_distance = np.ones(num_slots)
        self.distance = np.zeros(num_slots)
        self.tools: list[pymunk.Body | None] = [None] * num_slots

    def begin(self, slots: Slots, instances: Floats) -> None:
        """Put pucks and held ends at their start and the goals where `instances` (b, I) say."""
        self.forget(slots)
        self.goal[slots] = instances
        self.start_distance[slots] = np.linalg.norm(PUCK_START - instances, axis=1)
        self.distance[slots] = self.outcome[slots] = self.start_distance[slots]
        self.bodies[slots, PUCK_BODY] = (*PUCK_START, 0.0, 0.0)
        self.bodies[slots, TOOL_BODY] = (*TOOL_START, 0.0, 0.0)
        self._write_state(slots)

    def build(self, slots: Slots, designs: Floats) -> None:
        """Build the scenes with tools of `designs` (b, D)."""
        points = chain_points(designs, FIRST_LINK_ANGLE)
        self.bodies[slots, TOOL_BODY, 0] = TOOL_START[0] + start_shift(points)
        self._write_state(slots)
        self.add_spaces(slots, points)

    def build_space(self, slot: int, points: Floats) -> pymunk.Space:
        """Return the scene of one episode: puck, table friction, tool."""
        space = pymunk.Space()
        mass = PUCK_DENSITY * np.pi * PUCK_RADIUS**2
        puck = pymunk.Body(mass, float("inf"))  # A round puck's spin changes nothing that matters here.
        puck.position = tuple(PUCK_START.tolist())
        disc = pymunk.Circle(puck, PUCK_RADIUS)
        disc.friction = 1.0  # pymunk multiplies the two frictions of a contact.
        table = pymunk.PivotJoint(space.static_body, puck, (0.0, 0.0), (0.0, 0.0))
        table.max_bias = 0.0
        table.max_force = mass * PUCK_DECELERATION
        tool, links = chain_tool(points, CONTACT_FRICTION)
        tool.position = tuple(self.bodies[slot, TOOL_BODY, PLACE].tolist())
        space.add(puck, disc, table)
        space.add(tool, *links)
        self.tools[slot] = tool
        return space

    def step(self, slots: Slots, controls: Floats) -> None:
        """Move the held ends by `controls` (b, C) for one control step and reward the pucks' progress."""
        period = self.clock.control_period
        base = self.bodies[slots, TOOL_BODY, PLACE]
        velocity = (np.clip(base + controls * (MAX_SPEED * period), *WORKSPACE.bounds) - base) / period
        for slot, pair in zip(slots.tolist(), velocity.tolist(), strict=True):
            tool = self.tools[slot]
            assert tool is not None, "a tool is built before it is moved"
            tool.velocity = tuple(pair)
        self.advance(slots)
        puck = self.read_bodies(slots)[:, PUCK_BODY]
        distance = np.linalg.norm(puck[:, PLACE] - self.goal[slots], axis=1)
        speed = np.linalg.norm(puck[:, VELOCITY], axis=1)
        self.set_success(slots, REST_STEPS, at_goal=distance < GOAL_RADIUS, at_rest=speed < REST_SPEED)
        self.set_reward(
            slots,
            progress=(self.distance[slots] - distance) / self.start_distance[slots],
            slack=SLACK_REWARD,
            success=SUCCESS_REWARD * self.success[slots],
        )
        self.distance[slots] = distance
        self.outcome[slots] = distance
        self._write_state(slots)

    def mark(self, slot: int, canvas: Canvas) -> None:
        """Draw the goal."""
        canvas.circle(self.goal[slot].tolist(), GOAL_RADIUS, COLOURS["goal"], filled=False)

    def _write_state(self, slots: Slots) -> None:
        puck, base = self.bodies[slots, PUCK_BODY], self.bodies[slots, TOOL_BODY, PLACE]
        self.state[slots, PUCK] = puck[:, PLACE]
        self.state[slots, PUCK_VELOCITY] = puck[:, VELOCITY]
        self.state[slots, BASE] = base
        self.state[slots, PUCK_TO_GOAL] = self.goal[slots] - puck[:, PLACE]
        self.state[slots, BASE_TO_PUCK] = puck[:, PLACE] - base


def start_shift(points: Floats) -> Floats:
    """Return how far (b,) from `TOOL_START` tools with chain `points` (b, 4, 2) start along x to be clear, in m."""
    return nearest_clear_shift(*_blocked_shifts(points))


def _blocked_shifts(points: Floats) -> tuple[Floats, Floats]:
    """Return the ends (b, 3) of each link's interval of shifts at which it is too close to the puck; NaN if none.

    A link's core must keep out of the disc of radius `reach` around the puck. The shifts at which it does not are those
    at which one of its ends lies in the disc, or its inner part crosses the disc; together they are one interval.
    """
    reach = PUCK_RADIUS + LINK_HALF_WIDTH + START_CLEARANCE
    # The links as seen from the puck, without a shift.
    start, end = points[:, :-1] + TOOL_START - PUCK_START, points[:, 1:] + TOOL_START - PUCK_START
    lows, highs = [], []
    for at in (start, end):
        # An end moves along the chord that the disc cuts out of its height; above or below the disc there is none.
        half = np.sqrt(np.where(np.abs(at[..., 1]) < reach, reach**2 - at[..., 1] ** 2, np.nan))
        lows.append(-at[..., 0] - half)
        highs.append(-at[..., 0] + half)
    length = np.linalg.norm(end - start, axis=-1)
    direction = (end - start) / length[..., None]
    normal = np.stack([-direction[..., 1], direction[..., 0]], axis=-1)
    across = np.where(np.abs(normal[..., 0]) > 1e-9, normal[..., 0], np.nan)  # A level link does not move sideways.
    for side in (-reach, reach):
        # The link's line touches the disc at this shift; it counts if the point of contact is on the link itself.
        shift = (side - (start * normal).sum(-1)) / across
        along = -((start * direction).sum(-1) + shift * direction[..., 0])
        touches = np.where((along > 0.0) & (along < length), shift, np.nan)
        lows.append(touches)
        highs.append(touches)
    return np.fmin.reduce(lows), np.fmax.reduce(highs)
