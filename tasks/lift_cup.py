"""Lift cup: a held fork grips a cup under its rim and lifts it. Docstring of `LiftCup` has the details.

Shapes: `B` slots, `b` slots a call names, `I` = 2 instance (cup's width and height), `D` = 5 design, `C` = 3 control,
`K` = 9 boxes of a cup.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np

from codesign_bench.task import (
    OURS,
    Behaviour,
    Box,
    ByProfile,
    Floats,
    Given,
    Quantity,
    Simulator,
    Slots,
    Soundness,
    Task,
    ToolGraph,
    ToolPart,
    constants,
)
from codesign_bench.task.robot import DeployedSimulator, DeploymentSpec, RobotTrials

from ._bullet import (
    BULLET_SCENE,
    MAX_SLOTS,
    PLACE,
    ROTATION,
    VELOCITY,
    Boxes,
    BulletSimulator,
    Triple,
    box_parts,
    rotation_matrices,
    rotations_about,
)
from ._carriers import MISSING, Carrier
from ._deployed import (
    DEPLOYED_SCENE,
    NEAR_MISS,
    REAL_ROBOT,
    TRIAL_STEPS,
    TRIALS_PER_TOOL,
    arm_carrier,
    gripper_handle,
)
from ._marks import Camera, Marks
from ._scene import COLOURS, Clock

PAPER = "paper, table of lift cup"
CUP_RANGE = "ours; the paper's real cups lie within"
MOVES = "paper, its first three entries; that tools are not turned: ours, after the paper's text"

TOOL_START: Annotated[Floats, Given("m", PAPER, "tool_position_init")] = np.array([0.0, 1.2, 0.05])
"""Where the held end of the handle starts; z is measured from the table top (ours)."""
BOX_MIN: Annotated[Triple, Given("m", PAPER, "box_dimensions_min")] = (0.005, 0.02, 0.01)
"""Smallest width, length and height of a prong, read as half extents (our reading)."""
BOX_MAX: Annotated[Triple, Given("m", PAPER, "box_dimensions_max")] = (0.01, 0.1, 0.03)
"""Largest width, length and height of a prong, read as half extents (our reading)."""
ANGLE_MIN: Annotated[float, Given("degrees", PAPER, "tool_angle_min")] = -30.0
"""Smallest tilt of the prongs."""
ANGLE_MAX: Annotated[float, Given("degrees", PAPER, "tool_angle_max")] = 30.0
"""Largest tilt of the prongs."""
HANDLE_HALF_EXTENTS: Annotated[Floats, Given("m", "ours; the paper says that it is fixed")] = np.array(
    [0.01, 0.05, 0.01]
)
"""Half extents of the handle."""
BAR_THICKNESS: Annotated[float, Given("m", OURS)] = 0.02
"""Thickness of the cross bar, along y and z."""
PRONG_START = 2.0 * HANDLE_HALF_EXTENTS[1] + BAR_THICKNESS
"""Distance of the prongs' rear ends from the held end, along y, m."""
TOOL_CLEARANCE: Annotated[float, Given("m", OURS)] = 0.002
"""The lowest point of a tool stays this far above the table."""
WORKSPACE: Annotated[Box, Given("m", OURS)] = Box.of(
    held_x=(-0.15, 0.15, "m"), held_y=(1.1, 1.75, "m"), held_z=(0.0, 0.7, "m")
)
"""Range of the held end; a tool's lowest point limits z further."""
CONTROL_MIN: Annotated[Triple, Given("1", MOVES, "control_action_min")] = (-1.0, -1.0, -1.0)
"""Lower bounds of a control along x, y and z, before scaling."""
CONTROL_MAX: Annotated[Triple, Given("1", MOVES, "control_action_max")] = (1.0, 1.0, 1.0)
"""Upper bounds of a control, before scaling."""
MAX_MOVE: Annotated[float, Given("m", OURS, "control_action_scale")] = 0.02
"""Largest displacement of the held end in a control step: 0.48 m/s, too slow to knock a cup away; the paper's scale
would be 2.4 m/s."""

CUP_UNIT: Annotated[float, Given("m", OURS)] = 0.18
"""Width and height of a cup of scale 1: rims of all widths fit between prongs of the design space."""
CUP_WIDTHS: Annotated[tuple[float, float], Given("1", CUP_RANGE)] = (0.2, 1.0)
"""Smallest and largest scale of a cup's width."""
CUP_HEIGHTS: Annotated[tuple[float, float], Given("1", CUP_RANGE)] = (0.5, 1.0)
"""Smallest and largest scale of a cup's height."""
CUP_START_Y: Annotated[float, Given("m", OURS)] = 1.65
"""Start of cups along y, with x = 0: no fork reaches a rim at the start."""
CUP_MASS: Annotated[float, Given("kg", OURS)] = 0.2
"""Mass of a cup."""
WALL: Annotated[float, Given("m", OURS)] = 0.008
"""Thickness of walls and bottom."""
RIM_WIDTH: Annotated[float, Given("m", OURS)] = 0.009
"""Width of the rim beyond the walls: the play of a prong between the wall and the rim's edge."""
RIM_THICKNESS: Annotated[float, Given("m", OURS)] = 0.008
"""Thickness of the rim."""
WALL_GAP: Annotated[float, Given("m", OURS)] = 0.002
"""Gap between the walls and the underside of the bottom: a cup on the table then has 4 contacts instead of 20."""
CUP_FRICTION: Annotated[float, Given("1", OURS)] = 0.25
"""Friction of the cup; table and tool have 1, and the engine multiplies the two."""
TABLE_TOP: Annotated[tuple[tuple[float, float], tuple[float, float]], Given("m", OURS)] = (-0.5, 0.5), (0.8, 2.4)
"""Range of the table along x and y."""
TABLE_HALF_THICKNESS: Annotated[float, Given("m", OURS)] = 0.1
"""Half thickness of the table."""

SUCCESS_HEIGHT: Annotated[float, Given("m", REAL_ROBOT, "lift_cup_height")] = 0.4
"""The cup's lowest corner must rise above this."""
UPRIGHT: Annotated[float, Given("1", OURS)] = 0.9
"""Cosine of the tilt up to which a cup is upright: 26 degrees."""
TIPPED: Annotated[float, Given("1", OURS)] = 0.7
"""Cosine of the tilt beyond which a cup has tipped over: 46 degrees."""
FALLEN_HEIGHT: Annotated[float, Given("m", OURS)] = -0.05
"""A cup whose centre is below this has fallen off the table."""

LIFT_WEIGHT: Annotated[float, Given("1/m", OURS)] = 10.0
"""Weight of the cup's height in the reward."""
FIT_WEIGHT: Annotated[float, Given("1/m", OURS)] = 4.0
"""Weight of the distance between prongs and rim in the reward."""
FIT_LENGTH: Annotated[float, Given("m", OURS)] = 0.03
"""Length scale within which the prongs fit the rim."""
PLAY: Annotated[float, Given("m", OURS)] = 0.25 * RIM_WIDTH
"""Prongs this far from the middle of the rim still fit perfectly."""
START_POTENTIAL: Annotated[float, Given("1", OURS)] = -1.0
"""Potential at every episode's start: that of prongs 0.25 m away."""
SLACK_REWARD: Annotated[float, Given("1", PAPER, "slack_reward")] = -0.001
"""Added in every control step."""
SUCCESS_REWARD: Annotated[float, Given("1", PAPER, "success_reward")] = 10.0
"""Added once, when the cup is lifted."""

REAL_CUPS: Annotated[tuple[tuple[float, float], ...], Given("1", REAL_ROBOT, "lift_cup_sizes")] = (
    (0.3, 0.6),
    (0.3, 0.9),
    (0.5, 0.8),
    (0.9, 0.6),
)
"""Scales of width and height of the cups for which the paper's printed tools were designed."""
ARM_BASE: Annotated[Triple, Given("m", OURS)] = (0.0, 1.0, 0.3)
"""Position of a robot's base: 0.3 m above the table and 0.65 m in front of the cup.

From there a Panda reaches from below the rims to the lifted cup; the paper does not give its robot's position.
"""
ARM_CAMERA = Camera(eye=(1.5, 1.45, 0.7), target=(0.0, 1.3, 0.42))
"""View of arm and cup in deployment."""

HORIZON: Annotated[int, Given("control steps", PAPER, "max_episode_steps")] = 150
"""Time limit."""
STEPS_PER_CONTROL: Annotated[int, Given("physics steps", PAPER, "control_steps_per_action")] = 10
"""In a control step."""
PHYSICS_PERIOD: Annotated[float, Given("s", "PyBullet's own")] = 1.0 / 240.0
"""Of a physics step."""
CLOCK = Clock(STEPS_PER_CONTROL, PHYSICS_PERIOD)

FORK_GRAPH = ToolGraph(num_nodes=4, edges=((0, 1), (1, 2), (1, 3)), parameter_nodes=(1, 2, 2, 2, 2))
"""Handle, cross bar, left and right prong; the right prong mirrors the left one and has no parameters."""


(_WIDTH, _LENGTH, _HEIGHT) = ((2.0 * low, 2.0 * high, "m") for low, high in zip(BOX_MIN, BOX_MAX, strict=True))
DESIGN = Box.of(
    prong_distance=_LENGTH,  # the paper gives no range for the distance
    prong_tilt=(float(np.deg2rad(ANGLE_MIN)), float(np.deg2rad(ANGLE_MAX)), "rad"),
    prong_width=_WIDTH,
    prong_length=_LENGTH,
    prong_height=_HEIGHT,
)

CONTROL = Box(
    names=("move_x", "move_y", "move_z"),
    low=tuple(MAX_MOVE * bound for bound in CONTROL_MIN),
    high=tuple(MAX_MOVE * bound for bound in CONTROL_MAX),
    units=("m", "m", "m"),
)
INSTANCE = Box.of(
    cup_width_scale=(*CUP_WIDTHS, f"{CUP_UNIT:g} m"),
    cup_height_scale=(*CUP_HEIGHTS, f"{CUP_UNIT:g} m"),
)
CUP_WIDTH = INSTANCE.index("cup_width_scale")
STATE = Box.of(
    held_x=(WORKSPACE.low[0], WORKSPACE.high[0], "m"),
    held_y=(WORKSPACE.low[1], WORKSPACE.high[1], "m"),
    held_z=(WORKSPACE.low[2], WORKSPACE.high[2], "m"),
    cup_way_x=(-1.0, 1.0, "m"),
    cup_way_y=(-1.0, 1.0, "m"),
    cup_way_z=(-1.0, 1.0, "m"),
    prongs_to_cup_x=(-1.0, 1.0, "m"),
    prongs_to_cup_y=(-1.0, 1.0, "m"),
    prongs_to_cup_z=(-1.0, 1.0, "m"),
    prongs_to_rim_z=(-1.0, 1.0, "m"),
    left_clearance=(-1.0, 1.0, "m"),
    right_clearance=(-1.0, 1.0, "m"),
    cup_x_axis_z=(-1.0, 1.0, "-"),
    cup_y_axis_z=(-1.0, 1.0, "-"),
    cup_z_axis_z=(-1.0, 1.0, "-"),
    cup_y_axis_x=(-1.0, 1.0, "-"),
    cup_velocity_x=(-5.0, 5.0, "m/s"),
    cup_velocity_y=(-5.0, 5.0, "m/s"),
    cup_velocity_z=(-5.0, 5.0, "m/s"),
)
HELD, CUP_WAY, CUP_VELOCITY = STATE.group("held_"), STATE.group("cup_way_"), STATE.group("cup_velocity_")
CUP_HEIGHT, PRONGS_TO_CUP = STATE.index("cup_way_z"), STATE.group("prongs_to_cup_")
PRONGS_TO_CUP_XY, PRONGS_TO_RIM = STATE.slice("prongs_to_cup_x", "prongs_to_cup_y"), STATE.index("prongs_to_rim_z")
LEFT_CLEARANCE, RIGHT_CLEARANCE = STATE.index("left_clearance"), STATE.index("right_clearance")
CUP_AXES_Z, CUP_UPRIGHT = STATE.slice("cup_x_axis_z", "cup_y_axis_z", "cup_z_axis_z"), STATE.index("cup_z_axis_z")
CUP_TURN = STATE.index("cup_y_axis_x")


class LiftCup(Task):
    """Lift a cup of given width and height from the table (paper, appendix "Environment Details").

    The tool is a fork: a handle, a cross bar and two prongs. The robot holds the end of the handle and moves it without
    rotation. The cup is square, closed at the bottom, and has a protruding rim. Prongs on both sides of the cup lift it
    by the rim. Prongs closer together than the cup is wide do not pass the walls; prongs further apart than the rim's
    edges miss it; short prongs, and prongs that slope down, let the cup tip. So the fork must match the cup: each prong
    has the rim's width of play, and no fork lifts two cups whose widths differ by more than twice that.

    Action space
        Design, 5: distance between the prongs' inner faces (m), tilt (rad), width, length and height of the prongs (m)
        (paper; the handle is fixed, and both prongs are the same). Control, 3: displacement x, y, z of the held end in
        a control step (m) (paper; range ours); its length is limited, not each entry.

    Observation
        State, 19: position of the held end, displacement of the cup from its start, displacement from the point midway
        between the prongs to the cup's centre of mass, x, y, z of each (m); height of the rim's underside above the
        prongs' top at their middle, and free width between each prong and the cup's walls (m); vertical components of
        the cup's three axes, and the x component of its y axis; velocity of the cup x, y, z (m/s). Goal, 2: scales of
        the cup's width and height. Then the design and the phase. Before the tool exists, all entries on prongs are 0.

    Design space
        The paper's table gives sizes, which we read as half extents, PyBullet's convention, but no range for the
        distance of the prongs; ours is that of their length. A positive tilt raises the tips; prongs rotate about their
        rear ends, in front of the cross bar. The right prong, node 3, mirrors the left one and has no parameters.

    Goal space
        Scales of the cup's width and height, uniform, over a range a little wider than that of the paper's four real
        cups (ours).

    Reward
        The change of a potential, plus the paper's slack (negative) and the paper's bonus on success. The potential
        increases as the prongs fit the rim better and as the cup is lifted. Four points under the rim, fixed to the
        cup, are in the middle of the rim's left and right sides, a quarter of the width in front of and behind the
        cup's centre. Their distance from the top edge of the prong on their side has a sideways part, with some play, a
        part along the prong beyond its ends, and a vertical part. The potential starts at the same value for every
        tool, so a tool that fits is rewarded for its fit in the first step. An episode's return is below 16.

    Starting state
        The cup at rest and the held end at the paper's position. Tools that would be too low there start higher, by as
        much as needed (ours). No fork reaches a rim at the start.

    Episode end
        Success when the cup's lowest corner is high enough and the cup is upright; failure when the cup has tipped over
        or fallen off the table; or the time limit. The lowest corner is computed from the cup's rotation, since the
        height of the centre is misleading for a tipped cup.
    """

    name = "lift_cup"
    missing = MISSING
    title = "Lift cup"
    version = 2
    scene: ClassVar = {**BULLET_SCENE, **DEPLOYED_SCENE, **constants(__name__)}
    horizon = HORIZON
    control_period = CLOCK.control_period
    design_space = DESIGN
    tool_graph = FORK_GRAPH
    control_space = CONTROL
    instance_space = INSTANCE
    goal_size = 2
    state_space = STATE
    reward_terms: ClassVar = {
        "progress": f"change of {LIFT_WEIGHT:g} h - {FIT_WEIGHT:g} d + f, starting from {START_POTENTIAL:g}; h the "
        f"height of the cup's lowest corner, m, at most {SUCCESS_HEIGHT:g} and 0 while the cup is not upright; d the "
        f"mean distance of four points under the rim from the prongs, m, {PLAY:g} m of it sideways for free; f the "
        f"mean of exp(-distance / {FIT_LENGTH:g} m)",
        "slack": f"{SLACK_REWARD:g}",
        "success": f"{SUCCESS_REWARD:g} in the step that solves the task",
    }
    success_conditions: ClassVar = {
        "lifted": f"the cup's lowest corner is higher than {SUCCESS_HEIGHT:g} m",
        "upright": f"the cup's axis is within {np.rad2deg(np.arccos(UPRIGHT)):.0f} degrees of the vertical",
    }
    failure_condition = (
        f"the cup is tipped by more than {np.rad2deg(np.arccos(TIPPED)):.0f} degrees, or has fallen off the table"
    )

    run_settings: ClassVar[ByProfile] = {
        "quick": {"steps": 400_000},
        "laptop": {"steps": 700_000},
        "workstation": {"steps": 1_500_000},
    }
    outcome = Quantity("height of the cup's lowest corner while upright", "m")
    max_slots = MAX_SLOTS
    soundness = Soundness(overlap=WALL, speed=4.0, outcome_change=0.01)

    def material(self, designs: Floats) -> Floats:
        """Return the volume of prongs and cross bar as a fraction of the largest, for designs (b, D) in their units."""
        used: Floats = _volume(designs) / _volume(self.design_space.bounds[1][None])
        return used

    def effort(self, controls: Floats) -> Floats:
        """Return the displacement of the held end as a fraction of the largest, for controls (b, C) in [-1, 1]."""
        way: Floats = np.minimum(1.0, np.linalg.norm(controls, axis=1))
        return way

    def tool_parts(self, design: Floats) -> tuple[ToolPart, ...]:
        """Return the handle, cross bar and prongs of the tool of a design (D,) in its units."""
        return box_parts(fork_boxes(design[None]))

    def script(self) -> Behaviour:
        """Return a script that moves the prongs to the sides of the cup and lifts."""
        from ._scripts.lift_cup import LiftCupScript  # imported here because that file imports this one

        return LiftCupScript(self)

    def make_simulator(self, num_slots: int, refinement: int = 1) -> Simulator:
        """Return a simulator of `num_slots` cups and forks."""
        return _LiftCupSimulator(num_slots, self.state_space.size, CLOCK.refined(refinement))

    @property
    def deployment(self) -> DeploymentSpec:
        """The paper's trials on a real robot, on a simulated arm."""
        return DeploymentSpec(_robot_trials(), _on_an_arm, gripper_handle)


def _robot_trials() -> RobotTrials:
    """Return the four cups of the paper's tools; there is no grid."""
    return RobotTrials(
        own=np.array(REAL_CUPS),
        grid=np.zeros((0, 0, INSTANCE.size)),
        success_outcome=SUCCESS_HEIGHT,
        near_miss=NEAR_MISS,
        trials_per_tool=TRIALS_PER_TOOL,
        max_steps=TRIAL_STEPS,
    )


def _on_an_arm(num_slots: int, arm: str) -> DeployedSimulator:
    """Return a simulator of `num_slots` cups with forks held by `arm`, viewed from the side."""
    carrier = arm_carrier(arm, ARM_BASE, CLOCK)
    simulator = _LiftCupSimulator(num_slots, STATE.size, CLOCK, carrier)
    simulator.camera = ARM_CAMERA
    return simulator


def _volume(designs: Floats) -> Floats:
    """Return the volume (b,) of prongs and cross bar, m^3."""
    distance, _, width, length, height = designs.T
    volume: Floats = 2.0 * width * length * height + (distance + 2.0 * width) * BAR_THICKNESS**2
    return volume


def fork_boxes(designs: Floats) -> Boxes:
    """Return handle, cross bar, left and right prong of designs (b, D) in the frame of the held end."""
    distance, tilt, width, length, height = designs.T
    count = len(designs)
    half_extents, centres = np.zeros((count, 4, 3)), np.zeros((count, 4, 3))
    half_extents[:, 0] = HANDLE_HALF_EXTENTS
    centres[:, 0, 1] = HANDLE_HALF_EXTENTS[1]
    half_extents[:, 1] = 0.5 * BAR_THICKNESS
    half_extents[:, 1, 0] = 0.5 * distance + width
    centres[:, 1, 1] = PRONG_START - 0.5 * BAR_THICKNESS
    half_extents[:, 2:] = 0.5 * np.stack([width, length, height], axis=1)[:, None]
    centres[:, 2:] = prong_middles(designs)[:, None]
    centres[:, 2:, 0] = 0.5 * (distance + width)[:, None] * np.array([-1.0, 1.0])
    rotations = rotations_about(0, np.stack([0.0 * tilt, 0.0 * tilt, tilt, tilt], axis=1))
    return Boxes(half_extents, centres, rotations)


def prong_middles(designs: Floats) -> Floats:
    """Return the points (b, 3) midway between the two prongs' centres, relative to the held end."""
    _, tilt, _, length, _ = designs.T
    return np.stack([0.0 * tilt, PRONG_START + 0.5 * length * np.cos(tilt), 0.5 * length * np.sin(tilt)], axis=1)


def lowest_points(designs: Floats) -> Floats:
    """Return the height (b,) of the lowest point of designs (b, D), relative to the held end; not positive."""
    _, tilt, _, length, height = designs.T
    # A prong rotates about its rear end: the lower end is the tip if it slopes down, else the rear. Half its height,
    # tilted as well, reaches below that.
    prong = np.minimum(0.0, length * np.sin(tilt)) - 0.5 * height * np.cos(tilt)
    lowest: Floats = np.minimum(prong, -max(HANDLE_HALF_EXTENTS[2], 0.5 * BAR_THICKNESS))
    return lowest


class _Cups:
    """Boxes, centre of mass and inertia of cups with widths (b,) and heights (b,), in m and kg."""

    def __init__(self, width: Floats, height: Floats) -> None:
        half, rim = 0.5 * width, 0.5 * width + RIM_WIDTH
        rim_half, wall_half = 0.5 * (RIM_WIDTH + WALL), 0.5 * (height - RIM_THICKNESS - WALL_GAP)
        same = np.ones_like(width)
        extents, places = [(half, half, 0.5 * WALL * same)], [(0.0 * same, 0.0 * same, 0.5 * WALL * same)]
        for side in (-1.0, 1.0):
            extents += [
                (0.5 * WALL * same, half, wall_half),
                (half - WALL, 0.5 * WALL * same, wall_half),
                (rim_half * same, rim, 0.5 * RIM_THICKNESS * same),
                (rim - 2.0 * rim_half, rim_half * same, 0.5 * RIM_THICKNESS * same),
            ]
            wall, edge = side * (half - 0.5 * WALL), side * (rim - rim_half)
            middle, top = WALL_GAP + wall_half, height - 0.5 * RIM_THICKNESS
            places += [
                (wall, 0.0 * same, middle),
                (0.0 * same, wall, middle),
                (edge, 0.0 * same, top),
                (0.0 * same, edge, top),
            ]
        self.half_extents: Floats = np.moveaxis(np.array(extents), -1, 0)
        """(b, K, 3)"""
        self.centres: Floats = np.moveaxis(np.array(places), -1, 0)
        """(b, K, 3), relative to the centre of mass."""
        volumes = self.half_extents.prod(axis=2)
        # The mass is divided among the boxes by volume, as if all had the same density.
        masses = CUP_MASS * volumes / _sum_of_boxes(volumes)[:, None]
        self.centre_height: Floats = _sum_of_boxes(masses * self.centres[..., 2]) / CUP_MASS
        """(b,) height of the centre of mass above the cup's underside."""
        self.centres[..., 2] -= self.centre_height[:, None]
        # Sum of m x^2 per axis: half^2 / 3 of each box about its own centre, plus its offset (parallel axes). The
        # moment about an axis is the sum over the two other axes. By symmetry in x and y, the axes are principal.
        squares = _sum_of_boxes(masses[..., None] * (self.half_extents**2 / 3.0 + self.centres**2))
        self.inertia: Floats = squares.sum(axis=1, keepdims=True) - squares
        """(b, 3) moments of inertia about the cup's axes."""


def _sum_of_boxes(values: Floats) -> Floats:
    """Return the sum of values (b, K, ...) over boxes in a fixed order.

    NumPy's sum of 8 or more values uses a different order for one cup than for many, and thus rounds differently.
    """
    total = np.zeros_like(values[:, 0])
    for box in range(values.shape[1]):
        total += values[:, box]
    return total


class _LiftCupSimulator(BulletSimulator):
    """A cup on a table and a fork, one pair per slot."""

    camera = Camera(eye=(0.75, 0.85, 0.55), target=(0.0, 1.55, 0.25))
    room = (*TABLE_TOP, (0.0, 1.0))
    _SIDES = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])
    """Signs along x and y of the four points under the rim."""

    def __init__(self, num_slots: int, state_size: int, clock: Clock, carrier: Carrier | None = None) -> None:
        super().__init__(num_slots, state_size, num_bodies=1, clock=clock, carrier=carrier)
        self.size = np.zeros((num_slots, 2))
        """(B, 2): width and height of the cup, m."""
        self.centre_height = np.zeros(num_slots)
        """(B,) height of the cup's centre of mass above its underside, m."""
        self.cup_start = np.zeros((num_slots, 3))
        self.designs = np.zeros((num_slots, DESIGN.size))
        self.prong_middle = np.zeros((num_slots, 3))
        self.lowest_hold = np.zeros(num_slots)
        """(B,) smallest allowed height of the held end, m."""
        self.potential = np.zeros(num_slots)
        self._cups: dict[int, tuple[list[list[float]], list[list[float]], list[float]]] = {}

    def begin(self, slots: Slots, instances: Floats) -> None:
        """Put cups of the sizes of `instances` (b, I) on their tables."""
        self.forget(slots)
        size = CUP_UNIT * instances
        cups = _Cups(*size.T)
        self.size[slots] = size
        self.centre_height[slots] = cups.centre_height
        self.cup_start[slots] = np.stack(
            [0.0 * size[:, 0], np.full(len(slots), CUP_START_Y), cups.centre_height], axis=1
        )
        parts = cups.half_extents.tolist(), cups.centres.tolist(), cups.inertia.tolist()
        self._cups.update(zip(slots.tolist(), zip(*parts, strict=True), strict=True))
        self.restart(slots)
        self.potential[slots] = START_POTENTIAL
        self.pose[slots] = TOOL_START
        self.state[slots] = 0.0
        self.state[slots, HELD] = TOOL_START
        self.state[slots, CUP_UPRIGHT] = 1.0

    def build_scene(self, slot: int) -> list[int]:
        """Add table and cup."""
        half, middle = zip(*(((high - low) / 2.0, (high + low) / 2.0) for low, high in TABLE_TOP), strict=True)
        self.add_box(slot, (*half, TABLE_HALF_THICKNESS), (*middle, -TABLE_HALF_THICKNESS))
        half_extents, centres, inertia = self._cups[slot]
        cup = self.add_compound(
            slot,
            half_extents,
            centres,
            self.cup_start[slot].tolist(),
            mass=CUP_MASS,
            inertia=inertia,
            friction=CUP_FRICTION,
            colour=COLOURS["object"],
        )
        return [cup]

    def build(self, slots: Slots, designs: Floats) -> None:
        """Add forks of `designs` (b, D) at the start, or higher if they would be too low there."""
        self.designs[slots] = designs
        self.prong_middle[slots] = prong_middles(designs)
        self.lowest_hold[slots] = TOOL_CLEARANCE - lowest_points(designs)
        poses = np.tile(TOOL_START, (len(slots), 1))
        poses[:, 2] = np.maximum(poses[:, 2], self.lowest_hold[slots])
        self.add_tools(slots, fork_boxes(designs), poses)
        self._observe(slots)

    def step(self, slots: Slots, controls: Floats) -> None:
        """Move the held ends by `controls` (b, C) and reward the lift of cups and the fit of prongs."""
        pose = self.pose[slots]
        length = np.linalg.norm(controls, axis=1, keepdims=True)
        low, high = (np.tile(bound, (len(slots), 1)) for bound in WORKSPACE.bounds)
        low[:, 2] = self.lowest_hold[slots]
        target = np.clip(pose + controls * (CONTROL.bounds[1] / np.maximum(1.0, length)), low, high)
        self.drive(slots, target - pose)
        self.advance(slots)
        self.read_tools(slots)
        self.read_bodies(slots)
        potential = self._observe(slots)
        self.set_reward(
            slots,
            progress=potential - self.potential[slots],
            slack=SLACK_REWARD,
            success=SUCCESS_REWARD * self.success[slots],
        )
        self.potential[slots] = potential

    def mark(self, slot: int, marks: Marks) -> None:
        """Draw a square at the height that the cup must reach."""
        x, y = 0.12 * np.array([[-1.0, 1.0, 1.0, -1.0, -1.0], [-1.0, -1.0, 1.0, 1.0, -1.0]])
        marks.line(np.column_stack([x, y + CUP_START_Y, np.full(5, SUCCESS_HEIGHT)]), COLOURS["goal"])

    def _observe(self, slots: Slots) -> Floats:
        """Write state, outcome, success and failure; return the reward's potential (b,)."""
        held, cup = self.pose[slots], self.bodies[slots, 0]
        width, height = self.size[slots].T
        place, turn = cup[:, PLACE], rotation_matrices(cup[:, ROTATION])
        axes = turn[:, 2]
        # Corners of the underside are at (+-width / 2, +-width / 2, -centre_height) in the cup's frame. For the lowest,
        # the signs make both terms negative, hence the absolute values.
        lowest = place[:, 2] - 0.5 * width * np.abs(axes[:, :2]).sum(axis=1) - self.centre_height[slots] * axes[:, 2]
        upright = axes[:, 2] > UPRIGHT
        lifted = np.where(upright, np.maximum(lowest, 0.0), 0.0)
        self.outcome[slots] = lifted
        self.set_success(slots, lifted=lowest > SUCCESS_HEIGHT, upright=upright)
        self.failure[slots] = (axes[:, 2] < TIPPED) | (place[:, 2] < FALLEN_HEIGHT)

        middle = held + self.prong_middle[slots]
        distance, tilt, _, _, prong_height = self.designs[slots].T
        prong_top = middle[:, 2] + 0.5 * prong_height / np.cos(tilt)
        rim = height - RIM_THICKNESS - self.centre_height[slots]
        state = self.state
        state[slots, HELD] = held
        state[slots, CUP_WAY] = place - self.cup_start[slots]
        state[slots, PRONGS_TO_CUP] = place - middle
        state[slots, PRONGS_TO_RIM] = place[:, 2] + rim - prong_top
        state[slots, LEFT_CLEARANCE] = place[:, 0] - held[:, 0] + 0.5 * (distance - width)
        state[slots, RIGHT_CLEARANCE] = held[:, 0] - place[:, 0] + 0.5 * (distance - width)
        state[slots, CUP_AXES_Z] = axes
        state[slots, CUP_TURN] = turn[:, 0, 1]
        state[slots, CUP_VELOCITY] = cup[:, VELOCITY]

        misfit = self._misfit(slots, place, turn, rim)
        # The linear part leads to the rim from any distance; the exponential adds a steep bonus close to it.
        fit = np.exp(-misfit / FIT_LENGTH) - FIT_WEIGHT * misfit
        potential: Floats = fit.mean(axis=1) + LIFT_WEIGHT * np.minimum(lifted, SUCCESS_HEIGHT)
        return potential

    def _misfit(self, slots: Slots, place: Floats, turn: Floats, rim: Floats) -> Floats:
        """Return the distances (b, 4) of points under the rim from the top edges of the prongs.

        The points are in the middle of the rim, left and right, a quarter of the cup's width in front of and behind its
        centre. A distance has a part along x from the prong's inner face, minus the play, one along y beyond the
        prong's ends, and one along z from its top edge.
        """
        width = self.size[slots, 0]
        local = np.empty((len(slots), 4, 3))
        local[..., 0] = (0.5 * (width + RIM_WIDTH))[:, None] * self._SIDES[:, 0]
        local[..., 1] = (0.25 * width)[:, None] * self._SIDES[:, 1]
        local[..., 2] = rim[:, None]
        points = place[:, None] + local @ turn.swapaxes(1, 2) - self.pose[slots][:, None]
        distance, tilt, _, length, height = self.designs[slots].T[..., None]
        along = np.clip(points[..., 1], PRONG_START, PRONG_START + length * np.cos(tilt))
        top = (along - PRONG_START) * np.tan(tilt) + 0.5 * height / np.cos(tilt)
        points[..., 0] = np.maximum(np.abs(points[..., 0] - 0.5 * distance * self._SIDES[:, 0]) - PLAY, 0.0)
        points[..., 1] -= along
        points[..., 2] -= top
        result: Floats = np.linalg.norm(points, axis=2)
        return result
