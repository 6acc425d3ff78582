"""Gather: a blade of free outline sweeps grains into a wanted circle. Docstring of `Gather` has the details.

Shapes: `b` slots a call names, `I` = 14 instance, `D` = 7 design, `C` = 2 control, `N` = 6 grains, `P` = 8 points.
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

from ._planar import COLOURS, PLACE, VELOCITY, Canvas, Clock, PlanarSimulator, View
from ._sides import TwoSides
from ._strip import (
    MIDDLE,
    SEGMENTS,
    STRIP_HALF_WIDTH,
    STRIP_SCENE,
    strip_graph,
    strip_lengths,
    strip_parts,
    strip_tool,
)

SEGMENT_WIDTH: Annotated[float, Given("m", OURS)] = 0.8
"""Width of each segment of the blade, along x: the blade is always as wide, whatever its outline."""
RISE: Annotated[float, Given("m", OURS)] = 0.8
"""Largest difference in y between the two ends of a segment."""

ROWS: Annotated[tuple[float, ...], Given("m", OURS)] = (0.0, 0.7)
"""Where the rows of grains lie, along y."""
COLUMNS: Annotated[tuple[float, ...], Given("m", OURS)] = (-0.8, 0.0, 0.8)
"""Where the columns of grains lie, along x."""
SCATTER: Annotated[float, Given("m", OURS)] = 0.14
"""Largest distance of a grain from its row and its column: grains never overlap."""
GRAIN_RADIUS: Annotated[float, Given("m", OURS)] = 0.2
"""Radius of a grain."""
GRAIN_FRICTION: Annotated[float, Given("1", OURS)] = 0.1
"""Friction between two grains, and between grain and blade."""
DRAG: Annotated[float, Given("1/s", OURS)] = 8.0
"""A grain that nothing pushes loses its speed at this rate: from full speed it slides on for a third of a metre."""

START_CLEARANCE: Annotated[float, Given("m", OURS)] = 0.2
"""Free distance along y between the foremost point of the blade and the nearest place of a grain, at the start."""
SIDEWAYS: Annotated[float, Given("m", OURS)] = 0.25
"""How far the hand can move to the left or right."""
MAX_SPEED: Annotated[tuple[float, float], Given("m/s", OURS)] = (0.3, 2.5)
"""Largest speed of the hand along x and y."""
FARTHEST: Annotated[float, Given("m", OURS)] = 9.0
"""Largest y of the hand."""

GOAL_SIDE: Annotated[tuple[float, float], Given("m", OURS)] = (0.8, 2.0)
"""Smallest and largest distance of the goal's centre from the line along which the hand starts."""
GOAL_Y: Annotated[tuple[float, float], Given("m", OURS)] = (4.5, 7.0)
"""Smallest and largest y of the goal's centre."""
GOAL_RADIUS: Annotated[float, Given("m", OURS)] = 0.9
"""The centre of every grain must be within this distance of the goal's centre."""
REST_SPEED: Annotated[float, Given("m/s", OURS)] = 0.3
"""Grains slower than this are at rest."""
REST_STEPS: Annotated[int, Given("control steps", OURS)] = 3
"""Number of consecutive steps for which all grains must rest in the circle."""
SLACK_REWARD: Annotated[float, Given("1", OURS)] = -0.001
"""Added in every control step."""
SUCCESS_REWARD: Annotated[float, Given("1", OURS)] = 1.0
"""Added once, when all grains rest in the circle."""

HORIZON: Annotated[int, Given("control steps", OURS)] = 75
"""Time limit: enough for one sweep and a little more."""
STEPS_PER_CONTROL: Annotated[int, Given("physics steps", OURS)] = 8
"""In a control step."""
PHYSICS_PERIOD: Annotated[float, Given("s", OURS)] = 1.0 / 120.0
"""Of a physics step: the blade moves a tenth of a grain's radius."""
CLOCK = Clock(STEPS_PER_CONTROL, PHYSICS_PERIOD)

NUM_GRAINS = len(ROWS) * len(COLUMNS)
KNOTS_X = (np.arange(SEGMENTS + 1) - 0.5 * SEGMENTS) * SEGMENT_WIDTH
"""(P,) x of the ends of the segments, relative to the hand, m."""
DEEPEST = (MIDDLE + 0.5) * RISE
"""Largest distance of a point of a blade from the hand along y, m."""
LOWEST_START = ROWS[0] - SCATTER - GRAIN_RADIUS - START_CLEARANCE - STRIP_HALF_WIDTH - DEEPEST
"""Smallest y at which a hand starts, m."""

SIDES_OF_GOAL = TwoSides(GOAL_SIDE, GOAL_Y)

DESIGN = Box.of(**{f"rise_{k + 1}": (-RISE, RISE, "m") for k in range(SEGMENTS)})
CONTROL = Box.of(
    velocity_x=(-MAX_SPEED[0], MAX_SPEED[0], "m/s"),
    velocity_y=(-MAX_SPEED[1], MAX_SPEED[1], "m/s"),
)
INSTANCE = Box.of(
    goal_x=(-GOAL_SIDE[1], GOAL_SIDE[1], "m"),
    goal_y=(*GOAL_Y, "m"),
    **{f"grain_{k + 1}_{axis}": (-SCATTER, SCATTER, "m") for k in range(NUM_GRAINS) for axis in "xy"},
)
GOAL, SCATTERS = INSTANCE.slice("goal_x", "goal_y"), INSTANCE.group("grain_")

GRAIN = Box.of(
    x=(-8.0, 8.0, "m"),
    y=(-6.0, 14.0, "m"),
    velocity_x=(-4.0, 4.0, "m/s"),
    velocity_y=(-4.0, 4.0, "m/s"),
)
"""Observation of one grain."""
STATE = Box.of(
    hand_x=(-SIDEWAYS, SIDEWAYS, "m"),
    hand_y=(LOWEST_START, FARTHEST, "m"),
    **{
        f"grain_{k + 1}_{name}": (low, high, unit)
        for k in range(NUM_GRAINS)
        for name, low, high, unit in zip(GRAIN.names, GRAIN.low, GRAIN.high, GRAIN.units, strict=True)
    },
)
HAND, GRAINS = STATE.slice("hand_x", "hand_y"), STATE.group("grain_")

GRAIN_BODIES, TOOL_BODY = slice(0, NUM_GRAINS), NUM_GRAINS
"""Rows of `PlanarSimulator.bodies`."""


class Gather(Task):
    """Sweep six grains together into a wanted circle with a blade of free outline (ours).

    Seen from above, a hand pushes a blade over a table, away from itself, and with it the grains that lie before the
    blade. Where the blade slants, grains slide along it until they meet in its pockets, so the outline determines where
    they come to lie: the deepest place of a funnel must be where the circle is. The hand hardly moves sideways, and
    slowly, and has time for one sweep. The farther away the circle, the flatter the funnel may be.

    Action space
        Design, 7: rise of each segment of the blade (m). Control, 2: velocity of the hand along x and y (m/s).

    Observation
        State, 26: position x, y of the hand (m); position x, y (m) and velocity x, y (m/s) of each grain, in the order
        in which they lay at the start. Goal, 2: centre x, y of the circle (m). Then the design and the phase.

    Design space
        A blade of seven straight segments of equal width. The rise of a segment is the difference in y between its
        right and its left end; the hand holds the middle of the middle segment.

    Goal space
        Circles to the left or right of the line along which the hand starts, at some distance before it, uniform. The
        grains lie in rows and columns, each scattered a little. Their places are not part of the goal, but the state
        contains them at the design step.

    Reward
        The decrease of the mean distance of the grains from the circle's centre, as a fraction of its initial value, a
        negative slack, and a bonus on success. An episode's return is below 2.

    Starting state
        Grains at rest; the hand at rest behind them, so far away that the foremost point of the blade leaves a fixed
        clearance.

    Episode end
        Success when all grains rest in the circle, or the time limit.
    """

    name = "gather"
    title = "Gather"
    scene: ClassVar = {**STRIP_SCENE, **constants(__name__)}
    horizon = HORIZON
    control_period = CLOCK.control_period
    design_space = DESIGN
    tool_graph = strip_graph(tuple(range(SEGMENTS)))
    control_space = CONTROL
    instance_space = INSTANCE
    goal_size = 2
    position_entries = ("goal_x", "goal_y")
    state_space = STATE
    reward_terms: ClassVar = {
        "progress": "(d_before - d_after) / d_start, d the mean distance of the grains from the circle's centre, m",
        "slack": f"{SLACK_REWARD:g}",
        "success": f"{SUCCESS_REWARD:g} in the step that solves the task",
    }
    success_conditions: ClassVar = {
        "all_inside": f"the centres of all {NUM_GRAINS} grains are within {GOAL_RADIUS:g} m of the circle's centre",
        "at_rest": f"every grain is slower than {REST_SPEED:g} m/s",
    }
    success_steps = REST_STEPS

    run_settings: ClassVar[ByProfile] = {"workstation": {"steps": 2_000_000}}
    outcome = Quantity("grains in the circle", "grains")
    soundness = Soundness(
        overlap=STRIP_HALF_WIDTH,
        speed=1.5 * float(np.hypot(*MAX_SPEED)),
        outcome_change=0.5,
    )

    def sample_instances(self, rng: np.random.Generator, count: int) -> Floats:
        """Return (count, I) random instances; the circle is on the left or right with equal probability."""
        instances = self.instance_space.sample(rng, count)
        instances[:, GOAL.start] = SIDES_OF_GOAL.sample_x(rng, count)
        return instances

    def in_region(self, instances: Floats) -> Booleans:
        """Return which goals (b, I) are within the ranges of distances to the side and of y."""
        return SIDES_OF_GOAL.contain(instances[:, GOAL])

    def in_cutout(self, instances: Floats, fraction: float) -> Booleans:
        """Return which goals (b, I) are in two patches, left and right, with `fraction` of the region's area."""
        return SIDES_OF_GOAL.in_patches(instances[:, GOAL], fraction)

    def material(self, designs: Floats) -> Floats:
        """Return the length of the blade along its outline as a fraction of the largest, for designs (b, D) in m."""
        longest = SEGMENTS * np.hypot(SEGMENT_WIDTH, RISE)
        fraction: Floats = strip_lengths(blade(designs)) / longest
        return fraction

    def effort(self, controls: Floats) -> Floats:
        """Return the norm of the hand's normalised velocity as a fraction of the largest, for controls (b, C)."""
        speed: Floats = np.linalg.norm(controls, axis=1) / np.sqrt(controls.shape[1])
        return speed

    def tool_parts(self, design: Floats) -> tuple[ToolPart, ...]:
        """Return the segments of the blade of a design (D,) in its units."""
        return strip_parts(blade(design[None])[0])

    def script(self) -> Behaviour:
        """Return a script that builds a bowl around the circle's x and pushes until the grains are there."""
        from ._scripts.gather import GatherScript  # imported here because that file imports this one

        return GatherScript(self)

    def make_simulator(self, num_slots: int, refinement: int = 1) -> Simulator:
        """Return a simulator of `num_slots` tables with six grains each."""
        return _GatherSimulator(num_slots, self.state_space.size, CLOCK.refined(refinement))


class _GatherSimulator(PlanarSimulator):
    """Grains on a table without borders, and a kinematic blade, per slot."""

    view = View(x=(-7.0, 7.0), y=(LOWEST_START - DEEPEST, FARTHEST + DEEPEST + 1.0))

    def __init__(self, num_slots: int, state_size: int, clock: Clock) -> None:
        super().__init__(num_slots, state_size, num_bodies=NUM_GRAINS + 1, clock=clock)
        self.goal = np.zeros((num_slots, 2))
        self.start_distance = np.ones(num_slots)
        self.distance = np.zeros(num_slots)
        """(B,) mean distances of the grains from the goals, m."""
        self.tools: list[pymunk.Body | None] = [None] * num_slots

    def begin(self, slots: Slots, instances: Floats) -> None:
        """Put grains and goals where `instances` (b, I) say."""
        self.forget(slots)
        grains = grain_starts(instances)
        self.goal[slots] = instances[:, GOAL]
        self.start_distance[slots] = self._distances(slots, grains).mean(axis=1)
        self.distance[slots] = self.start_distance[slots]
        self.bodies[slots, GRAIN_BODIES] = np.concatenate([grains, np.zeros_like(grains)], axis=2)
        self.bodies[slots, TOOL_BODY] = (0.0, LOWEST_START, 0.0, 0.0)
        self._write_state(slots)

    def build(self, slots: Slots, designs: Floats) -> None:
        """Build the scenes with blades of `designs` (b, D)."""
        points = blade(designs)
        self.bodies[slots, TOOL_BODY, 1] = LOWEST_START + DEEPEST - points[..., 1].max(axis=1)
        self._write_state(slots)
        self.add_spaces(slots, points)

    def build_space(self, slot: int, points: Floats) -> pymunk.Space:
        """Return the scene of one episode: grains and blade on a table that slows grains down."""
        space = pymunk.Space()
        space.damping = float(np.exp(-DRAG))  # the share of its velocity that a body keeps for a second
        own_friction = GRAIN_FRICTION**0.5  # pymunk multiplies the two friction coefficients of a contact
        for x, y, _, _ in self.bodies[slot, GRAIN_BODIES].tolist():
            grain = pymunk.Body(1.0, float("inf"))  # it slides and does not spin: a spin could not be observed
            grain.position = (x, y)
            disc = pymunk.Circle(grain, GRAIN_RADIUS)
            disc.friction = own_friction
            space.add(grain, disc)
        tool, shapes = strip_tool(points, own_friction)
        tool.position = tuple(self.bodies[slot, TOOL_BODY, PLACE].tolist())
        space.add(tool, *shapes)
        self.tools[slot] = tool
        return space

    def step(self, slots: Slots, controls: Floats) -> None:
        """Move the hands by `controls` (b, C) for one control step and reward the grains' progress."""
        period = self.clock.control_period
        hand = self.bodies[slots, TOOL_BODY, PLACE]
        # A kinematic blade cannot be stopped by anything, so its target is limited, and the velocity follows from it.
        target = np.clip(
            hand + controls * np.array(MAX_SPEED) * period, (-SIDEWAYS, LOWEST_START), (SIDEWAYS, FARTHEST)
        )
        for slot, pair in zip(slots.tolist(), ((target - hand) / period).tolist(), strict=True):
            tool = self.tools[slot]
            assert tool is not None, "a tool is built before it is moved"
            tool.velocity = tuple(pair)
        self.advance(slots)
        grains = self.read_bodies(slots)[:, GRAIN_BODIES]
        distances = self._distances(slots, grains[..., PLACE])
        inside = distances < GOAL_RADIUS
        speed = np.linalg.norm(grains[..., VELOCITY], axis=2).max(axis=1)
        self.set_success(slots, REST_STEPS, all_inside=np.all(inside, axis=1), at_rest=speed < REST_SPEED)
        distance = distances.mean(axis=1)
        self.set_reward(
            slots,
            progress=(self.distance[slots] - distance) / self.start_distance[slots],
            slack=SLACK_REWARD,
            success=SUCCESS_REWARD * self.success[slots],
        )
        self.distance[slots] = distance
        self.outcome[slots] = inside.sum(axis=1)
        self._write_state(slots)

    def mark(self, slot: int, canvas: Canvas) -> None:
        """Draw the circle."""
        canvas.circle(self.goal[slot].tolist(), GOAL_RADIUS, COLOURS["goal"], filled=False)

    def _distances(self, slots: Slots, grains: Floats) -> Floats:
        """Return the distances (b, N) of grains (b, N, 2) from the goals of their slots, m."""
        distances: Floats = np.linalg.norm(grains - self.goal[slots][:, None], axis=2)
        return distances

    def _write_state(self, slots: Slots) -> None:
        bodies = self.bodies[slots]
        self.state[slots, HAND] = bodies[:, TOOL_BODY, PLACE]
        self.state[slots, GRAINS] = bodies[:, GRAIN_BODIES].reshape(len(slots), -1)  # as in GRAIN


def blade(designs: Floats) -> Floats:
    """Return the points (b, P, 2) of blades of `designs` (b, D), from left to right, relative to the hand, m."""
    y = np.cumsum(np.pad(designs, ((0, 0), (1, 0))), axis=1)
    middle = 0.5 * (y[:, MIDDLE] + y[:, MIDDLE + 1])
    return np.stack([np.broadcast_to(KNOTS_X, y.shape), y - middle[:, None]], axis=2)


def grain_starts(instances: Floats) -> Floats:
    """Return where the grains of `instances` (b, I) lie at the start, (b, N, 2), column by column, m."""
    places = np.stack(np.meshgrid(COLUMNS, ROWS, indexing="ij"), axis=-1).reshape(-1, 2)
    starts: Floats = places + instances[:, SCATTERS].reshape(len(instances), NUM_GRAINS, 2)
    return starts
