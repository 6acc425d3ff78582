"""Push: a held chain of links pushes or pulls a puck until it stops at the goal. Docstring of `Push` has the details.

Shapes: `b` slots a call names, `I` = 2 instance (goal x, y), `D` = 5 design, `C` = 2 control.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pymunk

from codesign_bench.studies.corl2023.scenes import PLANAR_SCENES
from codesign_bench.task import (
    Behaviour,
    Booleans,
    Box,
    Floats,
    Quantity,
    Simulator,
    Singles,
    Slots,
    Soundness,
    Task,
    ToolPart,
)

from ._planar import (
    CHAIN_GRAPH,
    COLOURS,
    LINK_HALF_WIDTH,
    Canvas,
    Clock,
    PlanarSimulator,
    View,
    chain_design_space,
    chain_parts,
    chain_points,
    chain_tool,
)

TABLE = PLANAR_SCENES["push"]

TOOL_START = np.array(TABLE.tool_position_init, dtype=np.float64)
"""Where the held end starts, m (paper, table of push)."""
START_CLEARANCE = 0.25
"""A tool that would start closer to the puck than this starts left or right of there, whichever is nearer, m (ours)."""
FIRST_LINK_ANGLE = np.pi
"""The first link points left and passes above the puck, rad (ours)."""
WORKSPACE = Box.of(base_x=(14.0, 24.0, "m"), base_y=(6.5, 10.5, "m"))
"""Where the held end may go: too low a place to lift a deep hook over the puck and use it on the other side (ours)."""
MAX_SPEED = 6.0
"""Largest speed of the held end along each axis, m/s (ours): 0.1 m a physics step, a tenth of the puck's radius."""

PUCK_START = np.array([16.0, 8.25])
"""m (ours)."""
PUCK_RADIUS = 1.0
"""m (scale of the first author's early scenes)."""
PUCK_DENSITY = 1.0
"""kg/m^2 (scale of the early scenes)."""
PUCK_DECELERATION = 12.0
"""Friction of the table stops a sliding puck at this rate, m/s^2 (ours): at full tool speed within 1.5 m."""
CONTACT_FRICTION = 0.3
"""Between link and puck (scale of the early scenes)."""

GOAL_DISTANCE = (3.0, 5.0)
"""Smallest and largest distance of a goal from the puck's start, m (ours)."""
GOAL_RADIUS = 1.5
"""The puck's centre must stop within this distance of the goal, m (goal radius of the early scenes)."""
REST_SPEED = 0.2
"""A puck slower than this is at rest, m/s (ours)."""
REST_STEPS = 3
"""Control steps in a row for which the puck must rest at the goal (ours)."""
SUCCESS_REWARD = 1.0
"""Added once, when the puck rests at the goal (ours; the paper lists one for its 3D tasks only)."""

CLOCK = Clock(steps=2, period=1.0 / 60.0)
"""Two physics steps per control step (ours), each as long as the early scenes', s."""


class Push(Task):
    """Push a round puck with the tool such that it stops at the goal (paper, appendix "Environment Details").

    Seen from above. The tool is a chain of three links whose free end the robot holds and moves; it never turns, so
    what the tool can do to the puck is decided by its shape. At the start the chain passes above the puck. Goals lie
    all around: to push, a link must stand on the puck's far side from the goal, so goals below want a flat or hollow
    underside, goals on the left a link to the right of the puck, goals on the right a hook on its left, and goals above
    a hook beneath it. The held end stays in a box of 10 m x 4 m, too low to lift a deep hook over the puck: a tool that
    serves one side hardly serves the other.

    Action space
        Design, 5: lengths of three links, 1 to 3 m each, and the two angles between them, +-90 degrees (paper, table
        of push). Control, 2: velocity of the held end, +-6 m/s along x and y (range ours).

    Observation
        | index | what | unit | range |
        | --- | --- | --- | --- |
        | 0, 1 | puck position x, y | m | -6 .. 30 |
        | 2, 3 | puck velocity x, y | m/s | -20 .. 20 |
        | 4, 5 | held end's position x, y | m | 14 .. 24 and 6.5 .. 10.5 |
        | 6, 7 | from puck to goal x, y | m | -25 .. 25 |
        | 8, 9 | from held end to puck x, y | m | -25 .. 25 |
        | 10, 11 | goal position x, y | m | 11 .. 21 and 3.25 .. 13.25 |

        followed by the design (5, normalised) and the phase (3).

    Design space
        `Push.design_space`; length = 2 m (1 + r), r in [-0.5, 0.5]; angle = 90 degrees r, r in [-1, 1].

    Goal space
        Positions 3 to 5 m from the puck's start, uniform in area, all directions (ours).

    Reward
        (d_before - d_after) / d_start - 0.001 per control step, d the distance from puck to goal in m; +1 on success.
        An episode's return lies below 2.

    Starting state
        Puck at rest at (16, 8.25), held end at (20, 10) (paper) for every goal. A tool that would then lie on the puck
        starts at the nearest place to the left or right of there that is 0.25 m clear of it (ours).

    Episode end
        Success: the puck's centre is within 1.5 m of the goal and slower than 0.2 m/s for 3 control steps. Time limit:
        150 control steps of 1/30 s (150 is the paper's).
    """

    name = "push"
    title = "Push"
    horizon = TABLE.max_episode_steps
    control_period = CLOCK.control_period
    design_space = chain_design_space(
        TABLE.tool_length_init, TABLE.tool_length_ratio, TABLE.tool_angle_scale, TABLE.tool_angle_ratio
    )
    tool_graph = CHAIN_GRAPH
    control_space = Box.of(velocity_x=(-MAX_SPEED, MAX_SPEED, "m/s"), velocity_y=(-MAX_SPEED, MAX_SPEED, "m/s"))
    instance_space = Box.of(
        goal_x=(PUCK_START[0] - GOAL_DISTANCE[1], PUCK_START[0] + GOAL_DISTANCE[1], "m"),
        goal_y=(PUCK_START[1] - GOAL_DISTANCE[1], PUCK_START[1] + GOAL_DISTANCE[1], "m"),
    )
    goal_size = 2
    state_space = Box.of(
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

    outcome = Quantity("distance from puck to goal", "m")
    # A puck between two links at once leaves up to a fifth faster than they move, until the contact solver has both.
    soundness = Soundness(overlap=LINK_HALF_WIDTH, speed=1.25 * np.sqrt(2.0) * MAX_SPEED, outcome_change=0.1)

    def sample_instances(self, rng: np.random.Generator, count: int) -> Floats:
        """Return (count, I) goals, uniform in the area of the ring around the puck."""
        near, far = GOAL_DISTANCE
        distance = np.sqrt(rng.uniform(near**2, far**2, size=count))
        angle = rng.uniform(-np.pi, np.pi, size=count)
        return PUCK_START + distance[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)

    def in_cutout(self, instances: Floats, fraction: float) -> Booleans:
        """Tell which goals (b, I) lie in the two patches, above and below the puck, that cover `fraction` of the ring.

        A patch is a sector of the ring, centred in angle and in area, scaled alike in both (ours, after the paper's
        two patches of fetch cube).
        """
        near, far = GOAL_DISTANCE
        offset = instances[:, :2] - PUCK_START
        area = ((offset**2).sum(axis=1) - near**2) / (far**2 - near**2)
        turn = np.abs(np.arctan2(offset[:, 1], offset[:, 0])) / np.pi
        reach = 0.5 * np.sqrt(fraction)
        result: Booleans = (np.abs(area - 0.5) < reach) & (np.abs(turn - 0.5) < reach)
        return result

    def material(self, designs: Floats) -> Floats:
        """Return the used share of the largest total link length for designs (b, D) in their units."""
        total: Floats = designs[:, :3].sum(axis=1) / sum(self.design_space.high[:3])
        return total

    def effort(self, controls: Floats) -> Floats:
        """Return the share of the largest speed of the held end for controls (b, C) in [-1, 1]."""
        speed: Floats = np.linalg.norm(controls, axis=1) / np.sqrt(controls.shape[1])
        return speed

    def tool_parts(self, design: Floats) -> tuple[ToolPart, ...]:
        """Return the links of the tool of a design (D,) in its units."""
        return chain_parts(chain_points(design[None], FIRST_LINK_ANGLE)[0], LINK_HALF_WIDTH)

    def script(self) -> Behaviour:
        """Return a script that pulls or pushes the puck with whichever part of a tool lies behind it."""
        return _Script(self)

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
        self.rest_steps = np.zeros(num_slots, dtype=np.intp)
        self.tools: list[pymunk.Body | None] = [None] * num_slots

    def begin(self, slots: Slots, instances: Floats) -> None:
        """Put pucks and held ends at their start and the goals where `instances` (b, I) say."""
        self.goal[slots] = instances
        self.start_distance[slots] = np.linalg.norm(PUCK_START - instances, axis=1)
        self.distance[slots] = self.outcome[slots] = self.start_distance[slots]
        self.rest_steps[slots] = 0
        self.reward[slots] = 0.0
        self.success[slots] = False
        self.bodies[slots, 0] = (*PUCK_START, 0.0, 0.0)
        self.bodies[slots, 1] = (*TOOL_START, 0.0, 0.0)
        self._write_state(slots)

    def build(self, slots: Slots, designs: Floats) -> None:
        """Build the scenes with tools of `designs` (b, D)."""
        points = chain_points(designs, FIRST_LINK_ANGLE)
        self.bodies[slots, 1, 0] = TOOL_START[0] + start_shift(points)
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
        tool.position = tuple(self.bodies[slot, 1, :2].tolist())
        space.add(puck, disc, table)
        space.add(tool, *links)
        self.tools[slot] = tool
        return space

    def step(self, slots: Slots, controls: Floats) -> None:
        """Move the held ends by `controls` (b, C) for one control step and reward the pucks' progress."""
        period = self.clock.control_period
        base = self.bodies[slots, 1, :2]
        velocity = (np.clip(base + controls * (MAX_SPEED * period), *WORKSPACE.bounds) - base) / period
        for slot, pair in zip(slots.tolist(), velocity.tolist(), strict=True):
            tool = self.tools[slot]
            assert tool is not None, "a tool is built before it is moved"
            tool.velocity = tuple(pair)
        self.advance(slots)
        puck = self.read_bodies(slots)[:, 0]
        distance = np.linalg.norm(puck[:, :2] - self.goal[slots], axis=1)
        resting = (distance < GOAL_RADIUS) & (np.linalg.norm(puck[:, 2:], axis=1) < REST_SPEED)
        self.rest_steps[slots] = np.where(resting, self.rest_steps[slots] + 1, 0)
        self.success[slots] = self.rest_steps[slots] >= REST_STEPS
        progress = (self.distance[slots] - distance) / self.start_distance[slots]
        self.reward[slots] = progress + TABLE.slack_reward + SUCCESS_REWARD * self.success[slots]
        self.distance[slots] = distance
        self.outcome[slots] = distance
        self._write_state(slots)

    def mark(self, slot: int, canvas: Canvas) -> None:
        """Draw the goal."""
        canvas.circle(self.goal[slot].tolist(), GOAL_RADIUS, COLOURS["goal"], filled=False)

    def _write_state(self, slots: Slots) -> None:
        bodies = self.bodies[slots]
        self.state[slots, :4] = bodies[:, 0]
        self.state[slots, 4:6] = bodies[:, 1, :2]
        self.state[slots, 6:8] = self.goal[slots] - bodies[:, 0, :2]
        self.state[slots, 8:] = bodies[:, 0, :2] - bodies[:, 1, :2]


class _Script(Behaviour):
    """Brings a point of the tool behind the puck as seen from the goal, then moves on towards the goal.

    Every link has a few candidate points on both of its sides; the one whose side faces the goal best and that is near
    is taken. The way there is straight, so the puck may be pushed aside on it: what a tool is good for depends on its
    shape.
    """

    SHAPES: ClassVar[tuple[tuple[float, ...], ...]] = (
        (0.8, 0.9, -0.2, 0.2, 0.9),  # goals to the right: a long arm with a hook behind the puck
        (0.8, 0.9, -0.2, 0.2, 0.9),  # right above: none of 500 random tools solves these with this controller
        (-0.4, 0.2, -0.3, 0.5, 0.2),  # above: a slanted arm that lifts the puck on its way to the left
        (-0.6, 0.8, -0.8, 0.4, -0.4),
        (-0.2, 0.8, -0.8, 0.4, 0.6),  # left: down on the near side of the puck
        (-0.2, -0.8, -0.3, -0.6, 0.5),
        (0.9, -0.1, 0.8, -0.1, 0.5),  # below: a hollow arm above the puck
        (0.6, -0.8, 0.8, 0.5, -0.6),
    )
    """The best of 500 random tools for goals in each eighth of all directions, from the right anticlockwise."""
    POINTS_PER_LINK = 4
    NEARNESS = 0.15
    """What a metre of way costs, in units of the cosine between a link's side and the way to the goal."""

    def __init__(self, task: Push) -> None:
        self.task = task

    def design(self, observation: Singles) -> Singles:
        """Return one of eight tools by the goal's direction."""
        to_goal = observation[..., 6:8]
        count = len(self.SHAPES)
        turn = np.arctan2(to_goal[..., 1], to_goal[..., 0]) / (2.0 * np.pi)
        shapes: Singles = np.array(self.SHAPES, dtype=np.float32)[np.round(count * turn).astype(int) % count]
        return shapes

    def act(self, observation: Singles) -> Singles:
        """Return the held end's velocity, normalised."""
        seen = np.atleast_2d(observation).astype(np.float64)
        puck, base, to_goal = seen[:, 0:2], seen[:, 4:6], seen[:, 6:8]
        distance = np.linalg.norm(to_goal, axis=1, keepdims=True)
        heading = to_goal / np.maximum(distance, 1e-9)
        points, sides = self._places(seen[:, self.task.layout.design])
        held = puck[:, None] - (PUCK_RADIUS + LINK_HALF_WIDTH) * sides - points
        reachable = np.clip(held, *WORKSPACE.bounds)
        cost = np.linalg.norm(reachable - base[:, None], axis=2) + 5.0 * np.linalg.norm(reachable - held, axis=2)
        score = (sides * heading[:, None]).sum(axis=2) - self.NEARNESS * cost
        rows = np.arange(len(seen))
        way = held[rows, score.argmax(axis=1)] - base
        ready = np.linalg.norm(way, axis=1, keepdims=True) < 0.4
        speed = np.clip((distance - 0.5 * GOAL_RADIUS) / GOAL_RADIUS, 0.0, 0.7)
        control = np.where(ready, way + speed * heading, np.clip(way, -1.0, 1.0))
        result: Singles = np.clip(control, -1.0, 1.0).astype(np.float32)
        return result if observation.ndim == 2 else result[0]

    def _places(self, designs: Floats) -> tuple[Floats, Floats]:
        """Return points on the links, from the held end, and the direction in which each pushes: (B, P, 2) twice."""
        chain = chain_points(self.task.design_space.from_unit(designs), FIRST_LINK_ANGLE)
        link = chain[:, 1:] - chain[:, :-1]
        share = (np.arange(self.POINTS_PER_LINK) + 0.5) / self.POINTS_PER_LINK
        points = (chain[:, :-1, None] + share[:, None] * link[:, :, None]).reshape(len(designs), -1, 2)
        normal = np.stack([-link[..., 1], link[..., 0]], axis=-1) / np.linalg.norm(link, axis=-1, keepdims=True)
        sides = np.repeat(normal, self.POINTS_PER_LINK, axis=1)
        return np.concatenate([points, points], axis=1), np.concatenate([sides, -sides], axis=1)


def start_shift(points: Floats) -> Floats:
    """Return how far (b,) tools with chain `points` (b, 4, 2) must start from `TOOL_START` along x to be clear, in m.

    Along x, a link is too close to the puck over one interval. The tool starts at the place nearest to no shift that
    lies in no link's interval: at zero or at an end of an interval.
    """
    low, high = _blocked_shifts(points)
    candidates = np.concatenate([np.zeros((len(points), 1)), low, high], axis=1)
    inside = (candidates[:, :, None] > low[:, None] + 1e-9) & (candidates[:, :, None] < high[:, None] - 1e-9)
    distance = np.where(inside.any(axis=2) | np.isnan(candidates), np.inf, np.abs(candidates))
    result: Floats = candidates[np.arange(len(points)), distance.argmin(axis=1)]
    return result


def _blocked_shifts(points: Floats) -> tuple[Floats, Floats]:
    """Return the ends (b, 3) of each link's interval of shifts at which it is too close to the puck; NaN if none.

    A link's core must keep out of the disc of radius `reach` around the puck. The shifts at which it does not are those
    at which one of its ends lies in the disc, or its inner part crosses the disc; together they are one interval.
    """
    reach = PUCK_RADIUS + LINK_HALF_WIDTH + START_CLEARANCE
    start, end = points[:, :-1] + TOOL_START - PUCK_START, points[:, 1:] + TOOL_START - PUCK_START
    lows, highs = [], []
    for at in (start, end):
        half = np.sqrt(np.where(np.abs(at[..., 1]) < reach, reach**2 - at[..., 1] ** 2, np.nan))
        lows.append(-at[..., 0] - half)
        highs.append(-at[..., 0] + half)
    length = np.linalg.norm(end - start, axis=-1)
    direction = (end - start) / length[..., None]
    normal = np.stack([-direction[..., 1], direction[..., 0]], axis=-1)
    across = np.where(np.abs(normal[..., 0]) > 1e-9, normal[..., 0], np.nan)
    for side in (-reach, reach):
        shift = (side - (start * normal).sum(-1)) / across
        along = -((start * direction).sum(-1) + shift * direction[..., 0])
        touches = np.where((along > 0.0) & (along < length), shift, np.nan)
        lows.append(touches)
        highs.append(touches)
    return np.fmin.reduce(lows), np.fmax.reduce(highs)
