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
"""A tool that would start closer to the puck than this is shifted to the left or right, whichever is nearer."""
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
"""Range of the held end: too low to lift a deep hook over the puck and use it on the other side."""
MAX_SPEED: Annotated[float, Given("m/s", OURS)] = 6.0
"""Largest speed of the held end along each axis: a tenth of the puck's radius in a physics step."""

PUCK_START: Annotated[Floats, Given("m", OURS)] = np.array([16.0, 8.25])
"""Where the puck starts, at rest."""
PUCK_RADIUS: Annotated[float, Given("m", EARLY)] = 1.0
"""Radius of the puck."""
PUCK_DENSITY: Annotated[float, Given("kg/m^2", EARLY)] = 1.0
"""Density of the puck."""
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
"""Number of consecutive steps for which the puck must rest at the goal."""
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
    """Push a round puck with the tool so that it stops at the goal (paper, appendix "Environment Details").

    Seen from above, a robot holds the free end of a chain of three links and moves it without rotation. At the start
    the chain passes above the puck, and goals are all around it. A link can only push away from itself, so the goal
    determines where a link must be: above the puck for goals below, on its right for goals on the left, on its left, as
    a hook, for goals on the right, and below it for goals above. The held end stays in a box that is too low to lift a
    deep hook over the puck, so a tool for one side hardly works for the other.

    Action space
        Design, 5: lengths of the three links (m) and the two angles between them (rad) (paper). Control, 2: velocity of
        the held end along x and y (m/s) (ours).

    Observation
        State, 10: position and velocity of the puck, position of the held end, displacement from the puck to the goal
        and from the held end to the puck, x and y of each (m, m/s). Goal, 2: its position x, y (m). Then the design and
        the phase.

    Design space
        Length = initial length (1 + ratio), angle = scale * ratio (our reading of the paper's table). The table has
        three angles; a chain of three links has two joints, and the third angle is not used.

    Goal space
        Positions in a ring around the puck's start, in all directions, uniform in area (ours).

    Reward
        The decrease of the puck's distance from the goal, as a fraction of the initial distance, plus the paper's slack
        (negative) and a bonus on success. An episode's return is below 2.

    Starting state
        The puck at rest and the held end at the paper's position, the same for every goal. A tool that would overlap
        the puck there starts at the nearest clear position to the left or right (ours).

    Episode end
        Success when the puck comes to rest at the goal, or the time limit.
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
    # A puck squeezed between two links can leave up to a fifth faster than they move, before the contact solver
    # converges.
    soundness = Soundness(overlap=LINK_HALF_WIDTH, speed=1.25 * np.sqrt(2.0) * MAX_SPEED, outcome_change=0.1)

    def sample_instances(self, rng: np.random.Generator, count: int) -> Floats:
        """Return (count, I) goals, uniform in the area of the ring around the puck."""
        near, far = GOAL_DISTANCE
        # Area grows with the square of the distance, so the square is drawn uniformly.
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
        """Return which goals (b, I) are in the two patches, above and below the puck, with `fraction` of the ring.

        A patch is a sector of the ring, centred in angle and in area, with the same scale in both (ours, after the
        paper's two patches of fetch cube).
        """
        near, far = GOAL_DISTANCE
        offset = instances - PUCK_START
        # Goals are uniform in these two coordinates, both in [0, 1]: the area inside of the goal, and the absolute
        # angle. Folding the angle puts the two patches on top of each other, so a square with side sqrt(fraction) has
        # the share `fraction` of all goals.
        area = ((offset**2).sum(axis=1) - near**2) / (far**2 - near**2)
        turn = np.abs(np.arctan2(offset[:, 1], offset[:, 0])) / np.pi
        reach = 0.5 * np.sqrt(fraction)
        result: Booleans = (np.abs(area - 0.5) < reach) & (np.abs(turn - 0.5) < reach)
        return result

    def material(self, designs: Floats) -> Floats:
        """Return the total link length as a fraction of the largest, for designs (b, D) in their units."""
        return chain_material(designs, self.design_space)

    def effort(self, controls: Floats) -> Floats:
        """Return the speed of the held end as a fraction of the largest, for controls (b, C) in [-1, 1]."""
        speed: Floats = np.linalg.norm(controls, axis=1) / np.sqrt(controls.shape[1])
        return speed

    def tool_parts(self, design: Floats) -> tuple[ToolPart, ...]:
        """Return the links of the tool of a design (D,) in its units."""
        return chain_parts(chain_points(design[None], FIRST_LINK_ANGLE)[0], LINK_HALF_WIDTH)

    def script(self) -> Behaviour:
        """Return a script that pulls or pushes the puck with the part of a tool that is behind it."""
        from ._scripts.push import PushScript  # imported here because that file imports this one

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
        """Put pucks and held ends at their start, and goals at `instances` (b, I)."""
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
        puck = pymunk.Body(mass, float("inf"))  # infinite moment: the spin of a round puck does not matter here
        puck.position = tuple(PUCK_START.tolist())
        disc = pymunk.Circle(puck, PUCK_RADIUS)
        disc.friction = 1.0  # pymunk multiplies the two friction coefficients of a contact
        # Coulomb friction with a table that pymunk, seen from above, does not have: a joint that drags the puck's
        # velocity to zero with a limited force. Without bias it corrects only the velocity and never pulls the puck
        # back.
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
        # The workspace limits the target position, and the velocity follows from it: a kinematic tool cannot be stopped
        # by a wall. A held end near the border then stops exactly at it.
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
    """Return the shifts (b,) along x from `TOOL_START` at which tools with chain `points` (b, 4, 2) are clear, m."""
    return nearest_clear_shift(*_blocked_shifts(points))


def _blocked_shifts(points: Floats) -> tuple[Floats, Floats]:
    """Return the ends (b, 3) of each link's interval of shifts at which it is too close to the puck; NaN if none.

    The middle line of a link must stay outside of the disc of radius `reach` around the puck. It is inside if one of
    its ends is in the disc or its inner part crosses the disc; these shifts form one interval.
    """
    reach = PUCK_RADIUS + LINK_HALF_WIDTH + START_CLEARANCE
    # The ends of the links relative to the puck, without a shift.
    start, end = points[:, :-1] + TOOL_START - PUCK_START, points[:, 1:] + TOOL_START - PUCK_START
    lows, highs = [], []
    for at in (start, end):
        # Shifted along x, an end is in the disc on the chord at its height; above or below the disc there is no chord.
        half = np.sqrt(np.where(np.abs(at[..., 1]) < reach, reach**2 - at[..., 1] ** 2, np.nan))
        lows.append(-at[..., 0] - half)
        highs.append(-at[..., 0] + half)
    length = np.linalg.norm(end - start, axis=-1)
    direction = (end - start) / length[..., None]
    normal = np.stack([-direction[..., 1], direction[..., 0]], axis=-1)
    across = np.where(np.abs(normal[..., 0]) > 1e-9, normal[..., 0], np.nan)  # a level link moves along itself
    for side in (-reach, reach):
        # At this shift the link's line touches the disc; this counts only if the point of contact is on the link.
        shift = (side - (start * normal).sum(-1)) / across
        along = -((start * direction).sum(-1) + shift * direction[..., 0])
        touches = np.where((along > 0.0) & (along < length), shift, np.nan)
        lows.append(touches)
        highs.append(touches)
    return np.fmin.reduce(lows), np.fmax.reduce(highs)
