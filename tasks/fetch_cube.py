"""Fetch cube: a held chain of three boxes drags a cube out from under an overhang. Docstring of `FetchCube` has more.

Shapes: `b` slots a call names, `I` = 2 instance (cube's start x, y), `D` = 11 design, `C` = 3 control, `K` = 3 links.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np

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
from ._scene import COLOURS, Clock, nearest_clear_shift

PAPER = "paper, table of fetch cube"
MOVES = "paper, its first three entries; that tools are not turned: ours, after the paper's text"
UNSEEN = 'paper, section "Generalization to Unseen Goals Experiment Details"'

PAPER_ORIGIN: Annotated[float, Given("m", OURS)] = 1.2
"""The robot's base is at the origin and y points away from it: y = 1.2 m - y of the paper.

The paper prints cube starts in two frames; with this shift its real starts are at -y and its fine-tuning starts are
unsolved (see docs/tasks/fetch_cube.md).
"""
CUBE_X: Annotated[tuple[float, float], Given("m", UNSEEN, "fetch_cube_region.x")] = (-0.395, 0.395)
"""Starts of the cube's centre along x."""
PAPER_CUBE_Y: Annotated[tuple[float, float], Given("m", UNSEEN, "fetch_cube_region.y")] = (0.4, 0.7)
"""Starts of the cube's centre along y, in the paper's frame."""
CUBE_Y = (PAPER_ORIGIN - PAPER_CUBE_Y[1], PAPER_ORIGIN - PAPER_CUBE_Y[0])
"""Starts of the cube's centre along y, in our frame, m."""
PAPER_FINE_TUNING: Annotated[tuple[tuple[float, float], ...], Given("m", UNSEEN, "fine_tuning_starts")] = (
    (-0.167, 0.367),
    (-0.129, 0.357),
    (0.430, 0.493),
    (0.415, 0.610),
)
"""Starts outside the training region, in the paper's frame."""
FINE_TUNING_RADIUS: Annotated[float, Given("m", OURS)] = 0.015
"""Distance from such a start of the other instances at the same place: they are all outside the region."""
AROUND_START: Annotated[int, Given("instances", OURS)] = 7
"""Number of these others."""
CUBE_SIZE: Annotated[float, Given("m", REAL_ROBOT)] = 0.05
"""Side of the cube."""
CUBE_MASS: Annotated[float, Given("kg", OURS)] = 0.1
"""Mass of the cube."""
GOAL_DISTANCE: Annotated[float, Given("m", REAL_ROBOT, "fetch_cube_distance")] = 0.5
"""The cube is fetched when its centre is closer to the robot's base than this."""

HOLD_START: Annotated[Floats, Given("m", PAPER, "tool_position_init")] = np.array([0.0, 0.5, 0.02])
"""Where the held point starts."""
HOLD_X: Annotated[tuple[float, float], Given("m", "paper: 0.8 m wide; place ours")] = (-0.4, 0.4)
"""Range of the held point along x."""
HOLD_Y: Annotated[tuple[float, float], Given("m", "paper: 0.2 m deep; place ours")] = (0.3, 0.5)
"""Range of the held point along y: in front of the overhang's edge."""
HOLD_TOP: Annotated[float, Given("m", OURS)] = 0.04
"""Largest height of the held point: a thin tool touches the cube's side, never its top."""
GROUND_CLEARANCE: Annotated[float, Given("m", OURS)] = 0.001
"""Gap between the tallest link and the table."""
START_CLEARANCE: Annotated[float, Given("m", OURS)] = 0.005
"""A tool that would start closer to the cube than this is shifted to the left or right, whichever is nearer."""
CONTROL_MIN: Annotated[Triple, Given("1", MOVES, "control_action_min")] = (-1.0, -1.0, -1.0)
"""Lower bounds of a control along x, y and z, before scaling."""
CONTROL_MAX: Annotated[Triple, Given("1", MOVES, "control_action_max")] = (1.0, 1.0, 1.0)
"""Upper bounds of a control, before scaling."""
STEP_LENGTH: Annotated[float, Given("m", OURS, "control_action_scale")] = 0.02
"""Largest displacement of the held point in one control step, in the plane and vertically. The paper's scale would mean
up to 2.4 m/s, and cubes would be shot off the table."""

OVERHANG_Y: Annotated[tuple[float, float], Given("m", OURS)] = (0.5, 1.1)
"""Range of the overhang along y."""
OVERHANG_X: Annotated[tuple[float, float], Given("m", OURS)] = (-0.75, 0.75)
"""Range of the overhang along x: wider than the reach of any tool."""
OVERHANG_HEIGHT: Annotated[float, Given("m", OURS)] = 0.08
"""Height of its underside above the table: 2 cm above any tool."""
OVERHANG_THICKNESS: Annotated[float, Given("m", OURS)] = 0.02
"""Thickness of the overhang."""
TABLE_FRICTION: Annotated[float, Given("1", OURS)] = 0.5
"""Friction between cube and table."""
TOOL_FRICTION: Annotated[float, Given("1", OURS)] = 0.7
"""Friction between cube and tool: a link can drag the cube at up to 35 degrees from its normal."""

PROGRESS_WEIGHT: Annotated[float, Given("1/m", OURS)] = 10.0
"""Reward per metre that the cube moves nearer."""
SLACK_REWARD: Annotated[float, Given("1", PAPER, "slack_reward")] = -0.001
"""Added in every control step."""
SUCCESS_REWARD: Annotated[float, Given("1", PAPER, "success_reward")] = 10.0
"""Added once, when the cube is fetched."""

HORIZON: Annotated[int, Given("control steps", PAPER, "max_episode_steps")] = 100
"""Time limit."""
STEPS_PER_CONTROL: Annotated[int, Given("physics steps", PAPER, "control_steps_per_action")] = 10
"""In a control step."""
PHYSICS_PERIOD: Annotated[float, Given("s", "PyBullet's own")] = 1.0 / 240.0
"""Of a physics step."""
CLOCK = Clock(STEPS_PER_CONTROL, PHYSICS_PERIOD)

BOX_MIN: Annotated[Triple, Given("m", PAPER, "box_dimensions_min")] = (0.005, 0.05, 0.005)
"""Smallest width, length and height of a link, read as half extents (our reading)."""
BOX_MAX: Annotated[Triple, Given("m", PAPER, "box_dimensions_max")] = (0.015, 0.1, 0.02)
"""Largest width, length and height of a link, read as half extents (our reading)."""
SIZES = tuple((2.0 * low, 2.0 * high) for low, high in zip(BOX_MIN, BOX_MAX, strict=True))
"""Smallest and largest width, length and height of a link, m."""
ANGLE_MIN: Annotated[float, Given("degrees", PAPER, "tool_angle_min")] = -90.0
"""Smallest angle of a joint."""
ANGLE_MAX: Annotated[float, Given("degrees", PAPER, "tool_angle_max")] = 90.0
"""Largest angle of a joint."""
ANGLES = float(np.deg2rad(ANGLE_MIN)), float(np.deg2rad(ANGLE_MAX))
NUM_LINKS = 3

REAL_STARTS: Annotated[tuple[Triple, ...], Given("m", REAL_ROBOT, "fetch_cube_starts")] = (
    (-0.110, -0.803, 0.025),
    (-0.339, -0.588, 0.025),
    (0.155, -0.731, 0.025),
    (0.211, -0.633, 0.025),
)
"""Starts for which the paper's printed tools were designed, in its robot's frame."""
GRID_SHAPE: Annotated[tuple[int, int], Given("starts", REAL_ROBOT, "grid_shape")] = (3, 4)
"""Rows and columns of the grid of starts on which every printed tool is tried."""
GRID_EXTENT: Annotated[tuple[float, float], Given("m", REAL_ROBOT, "grid_extent")] = (0.12, 0.856)
"""Depth and width of this grid."""
ARM_BASE: Annotated[Triple, Given("m", "paper: at the origin; on the table: ours")] = (0.0, 0.0, 0.0)
"""Position of a robot's base."""
ARM_CAMERA = Camera(eye=(0.0, 1.75, 1.0), target=(0.0, 0.38, 0.16))
"""View of arm and cube in deployment, from behind the overhang."""

SIZE_NAMES = ("width", "length", "height")
DESIGN = Box.of(
    **{
        f"link_{link + 1}_{what}": (low, high, "m")
        for link in range(NUM_LINKS)
        for what, (low, high) in zip(SIZE_NAMES, SIZES, strict=True)
    },
    joint_1_angle=(ANGLES[0], ANGLES[1], "rad"),
    joint_2_angle=(ANGLES[0], ANGLES[1], "rad"),
)
LINK_SIZES, JOINT_ANGLES = DESIGN.group("link_"), DESIGN.group("joint_")

CONTROL = Box(
    names=("move_x", "move_y", "move_z"),
    low=tuple(STEP_LENGTH * bound for bound in CONTROL_MIN),
    high=tuple(STEP_LENGTH * bound for bound in CONTROL_MAX),
    units=("m", "m", "m"),
)
IN_PLANE = CONTROL.slice("move_x", "move_y")

INSTANCE = Box.of(cube_start_x=(*CUBE_X, "m"), cube_start_y=(*CUBE_Y, "m"))
START_X, START_Y = INSTANCE.index("cube_start_x"), INSTANCE.index("cube_start_y")

CHAIN_NAMES = ("hold", "joint_1", "joint_2", "tip")
"""Points of the chain, starting at the held point."""
TO_CUBE_NAMES = tuple(f"{point}_to_cube_{axis}" for point in CHAIN_NAMES for axis in "xy")
STATE = Box.of(
    cube_x=(-1.5, 1.5, "m"),
    cube_y=(-1.0, 2.0, "m"),
    cube_velocity_x=(-2.0, 2.0, "m/s"),
    cube_velocity_y=(-2.0, 2.0, "m/s"),
    cube_turn_cos=(-1.0, 1.0, "1"),
    cube_turn_sin=(-1.0, 1.0, "1"),
    cube_distance=(0.0, 2.5, "m"),
    hold_x=(-0.45, 0.45, "m"),
    hold_y=(0.25, 0.55, "m"),
    hold_z=(0.0, 0.05, "m"),
    **dict.fromkeys(TO_CUBE_NAMES, (-2.0, 2.0, "m")),
)
CUBE, CUBE_VELOCITY = STATE.slice("cube_x", "cube_y"), STATE.slice("cube_velocity_x", "cube_velocity_y")
TURN_COS, TURN_SIN = STATE.index("cube_turn_cos"), STATE.index("cube_turn_sin")
CUBE_DISTANCE, TO_CUBE = STATE.index("cube_distance"), STATE.slice(*TO_CUBE_NAMES)
HOLD, HOLD_IN_PLANE = STATE.slice("hold_x", "hold_y", "hold_z"), STATE.slice("hold_x", "hold_y")

XY = slice(0, 2)
"""The horizontal part of a position, m, or of a velocity, m/s."""


class FetchCube(Task):
    """Fetch a cube from under an overhang (paper, section "Environments" and appendix "Environment Details").

    The robot holds one end of a chain of three boxes and moves it, without rotation, in a box in front of the overhang.
    The cube is beneath the overhang and must come close to the robot's base, which is at the origin; y points away from
    the robot. The tool can touch only the cube's sides, so a link must be behind the cube. The cube's start determines
    which shape can do that: a hook for cubes in the middle, a chain bent inwards for those at the sides. One pull moves
    the cube at most by the depth of the held point's box. Cubes further away must be pulled twice, the second time by a
    part of the tool that is closer to the hand.

    Action space
        Design, 11: width, length and height of each of three links (m) and the two angles between them (rad) (paper).
        Control, 3: displacement x, y, z of the held point in a control step (m) (paper; range ours); its horizontal
        length is limited, not each axis.

    Observation
        State, 18: position and velocity of the cube x, y (m, m/s), cosine and sine of four times its angle about the
        vertical, its distance from the base (m), the held point x, y, z (m), and the displacements from the held point,
        the two joints and the tip to the cube, x and y of each (m). Goal, 2: start of the cube x, y (m). Then the
        design and the phase. Before the tool exists, its joints and tip are set to the held point.

    Design space
        Link by link, then the angles. Sizes are full widths, lengths and heights: we read the paper's table as half
        extents, PyBullet's convention, since tools of half the size would not reach behind the far cubes (ours). The
        first link points away from the robot (ours); both joints turn about the vertical. The table has three angles;
        the third is not used.

    Goal space
        Starts of the cube, uniform in a rectangle (paper, in our frame).

    Reward
        The decrease of the cube's distance from the base, plus the paper's slack (negative) and the paper's bonus on
        success. Progress telescopes, so moving the cube back and forth earns nothing. An episode's return is below 15.

    Starting state
        The cube at rest at its start; the held point at the paper's position, at the overhang's edge (ours), raised if
        a link is too high for that. A tool that would be too close to the cube there starts at the nearest clear
        position to the left or right (ours). So a tool may start with its hook behind the cube.

    Episode end
        Success when the cube's centre is close enough to the base, or the time limit.
    """

    name = "fetch_cube"
    missing = MISSING
    title = "Fetch cube"
    scene: ClassVar = {**BULLET_SCENE, **DEPLOYED_SCENE, **constants(__name__)}
    horizon = HORIZON
    control_period = CLOCK.control_period
    design_space = DESIGN
    tool_graph = ToolGraph(
        num_nodes=NUM_LINKS, edges=((0, 1), (1, 2)), parameter_nodes=(0, 0, 0, 1, 1, 1, 2, 2, 2, 1, 2)
    )
    control_space = CONTROL
    instance_space = INSTANCE
    goal_size = 2
    position_entries = ("cube_start_x", "cube_start_y")
    state_space = STATE
    reward_terms: ClassVar = {
        "progress": f"{PROGRESS_WEIGHT:g} (d_before - d_after), d the distance from cube to base, m",
        "slack": f"{SLACK_REWARD:g}",
        "success": f"{SUCCESS_REWARD:g} in the step that solves the task",
    }
    success_conditions: ClassVar = {"at_base": f"the cube's centre is closer than {GOAL_DISTANCE:g} m to the base"}

    outcome = Quantity("distance from cube to base", "m")
    max_slots = MAX_SLOTS
    soundness = Soundness(overlap=0.006, speed=0.8, outcome_change=0.01)

    def in_cutout(self, instances: Floats, fraction: float) -> Booleans:
        """Return which starts (b, I) are in the two patches that cover `fraction` of the training region.

        The paper's patches are the left and the right half of the region, each shrunk about its centre by the square
        root of the fraction. The printed patches cover 0.597; we read this as 0.6 and scale to other fractions (ours).
        """
        half = 0.5 * np.sqrt(fraction)
        width, depth = CUBE_X[1], CUBE_Y[1] - CUBE_Y[0]
        across = np.abs(np.abs(instances[:, START_X]) - 0.5 * width) / width
        along = np.abs(instances[:, START_Y] - 0.5 * sum(CUBE_Y)) / depth
        result: Booleans = (across < half) & (along < half)
        return result

    def fine_tuning_instances(self) -> Floats:
        """Return (4, 8, I): the paper's four starts outside the training region, in our frame, each with seven others.

        These lie on a circle around it that stays outside the region.
        """
        x, y = np.array(PAPER_FINE_TUNING).T
        places = np.stack([x, PAPER_ORIGIN - y], axis=1)
        angles = 2.0 * np.pi * np.arange(AROUND_START) / AROUND_START
        circle = FINE_TUNING_RADIUS * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        return places[:, None, :] + np.concatenate([np.zeros((1, 2)), circle])

    def material(self, designs: Floats) -> Floats:
        """Return the volume of the links as a fraction of the largest, for designs (b, D) in their units."""
        sizes = designs[:, LINK_SIZES].reshape(-1, NUM_LINKS, len(SIZE_NAMES))
        largest = NUM_LINKS * np.prod([high for _, high in SIZES])
        volume: Floats = sizes.prod(axis=2).sum(axis=1) / largest
        return volume

    def effort(self, controls: Floats) -> Floats:
        """Return the displacement as a fraction of the largest, for controls (b, C) in [-1, 1]."""
        length: Floats = np.linalg.norm(controls, axis=1) / np.sqrt(controls.shape[1])
        return length

    def tool_parts(self, design: Floats) -> tuple[ToolPart, ...]:
        """Return the links of the tool of a design (D,) in its units."""
        return box_parts(chain_boxes(design[None])[1])

    def script(self) -> Behaviour:
        """Return a script that pulls the cube with a side of a link that it can move behind the cube."""
        from ._scripts.fetch_cube import FetchCubeScript  # imported here because that file imports this one

        return FetchCubeScript(self)

    def make_simulator(self, num_slots: int, refinement: int = 1) -> Simulator:
        """Return a simulator of `num_slots` cubes and tools."""
        return _FetchCubeSimulator(num_slots, self.state_space.size, CLOCK.refined(refinement))

    @property
    def deployment(self) -> DeploymentSpec:
        """The paper's trials on a real robot, on a simulated arm."""
        return DeploymentSpec(_robot_trials(), _on_an_arm, gripper_handle)


def _robot_trials() -> RobotTrials:
    """Return the four starts of the paper's tools and its 3 x 4 grid, in our frame.

    The real robot's frame is rotated by half a turn about the vertical, (x, y) -> (-x, -y): then y points away from the
    base, and unlike a reflection this does not swap left and right. The paper does not give the position of its grid.
    Ours is centred on the region of starts, so that the row nearest to the robot passes the start of tool 2; on both
    sides it extends 3 cm beyond the region.
    """
    own = -np.array(REAL_STARTS)[:, XY]
    (depth, width), (rows, columns) = GRID_EXTENT, GRID_SHAPE
    y = 0.5 * sum(CUBE_Y) + np.linspace(0.5 * depth, -0.5 * depth, rows)
    x = 0.5 * sum(CUBE_X) + np.linspace(-0.5 * width, 0.5 * width, columns)
    return RobotTrials(
        own,
        np.stack(np.meshgrid(x, y), axis=-1),
        success_outcome=GOAL_DISTANCE,
        near_miss=NEAR_MISS,
        trials_per_tool=TRIALS_PER_TOOL,
        max_steps=TRIAL_STEPS,
    )


def _on_an_arm(num_slots: int, arm: str) -> DeployedSimulator:
    """Return a simulator of `num_slots` cubes with tools held by `arm`, viewed from the side."""
    carrier = arm_carrier(arm, ARM_BASE, CLOCK)
    simulator = _FetchCubeSimulator(num_slots, STATE.size, CLOCK, carrier)
    simulator.camera, simulator.roofless = ARM_CAMERA, True
    return simulator


class _FetchCubeSimulator(BulletSimulator):
    """Table, overhang, cube and tool, one of each per slot."""

    camera = Camera(eye=(0.0, 0.56, 1.4), target=(0.0, 0.56, 0.0), up=(0.0, 1.0, 0.0), near=1.4 - 0.07)
    """Directly from above; the near plane cuts the overhang away."""
    room = ((-1.5, 1.5), (-1.0, 2.0), (0.4 * CUBE_SIZE, CUBE_SIZE))
    tool_friction = TOOL_FRICTION

    def __init__(self, num_slots: int, state_size: int, clock: Clock, carrier: Carrier | None = None) -> None:
        super().__init__(num_slots, state_size, num_bodies=1, clock=clock, carrier=carrier)
        self.roofless = False
        """Whether pictures omit the overhang, which hides the cube from a camera at the side."""
        self.start = np.zeros((num_slots, 2))
        self.distance = np.zeros(num_slots)
        self.low = np.tile([HOLD_X[0], HOLD_Y[0], 0.0], (num_slots, 1))
        """(B, 3): lower bounds of the held point, which depend on the tool's height."""
        self.high = np.array([HOLD_X[1], HOLD_Y[1], HOLD_TOP])
        self.points = np.zeros((num_slots, NUM_LINKS + 1, 2))
        """(B, 4, 2): points of the chain relative to the held point; zero before the design step."""

    def begin(self, slots: Slots, instances: Floats) -> None:
        """Put cubes at `instances` (b, I) and held points at their start."""
        self.forget(slots)
        self.start[slots] = instances
        self.pose[slots] = HOLD_START
        self.points[slots] = 0.0
        self.restart(slots)
        self.distance[slots] = np.linalg.norm(instances, axis=1)
        self._write_state(slots)

    def build_scene(self, slot: int) -> list[int]:
        """Add table, overhang and cube."""
        depth, thickness = OVERHANG_Y[1] - OVERHANG_Y[0], OVERHANG_THICKNESS
        self.add_box(slot, (2.5, 2.5, 0.1), (0.0, 0.5, -0.1), friction=TABLE_FRICTION, colour="#f2f2f0")
        overhang = self.add_box(
            slot,
            (OVERHANG_X[1], 0.5 * depth, 0.5 * thickness),
            (0.0, 0.5 * sum(OVERHANG_Y), OVERHANG_HEIGHT + 0.5 * thickness),
            friction=TABLE_FRICTION,
        )
        if self.roofless:
            self.hide(slot, overhang)
        x, y = self.start[slot].tolist()
        half = 0.5 * CUBE_SIZE
        cube = self.add_box(slot, (half,) * 3, (x, y, half), mass=CUBE_MASS, colour=COLOURS["object"])
        return [cube]

    def build(self, slots: Slots, designs: Floats) -> None:
        """Add tools of `designs` (b, D), each clear of its cube."""
        points, boxes = chain_boxes(designs)
        floor = boxes.half_extents[:, :, 2].max(axis=1) + GROUND_CLEARANCE
        poses = np.tile(HOLD_START, (len(slots), 1))
        poses[:, 0] += start_shift(boxes, HOLD_START[XY] - self.start[slots])
        poses[:, 2] = np.maximum(poses[:, 2], floor)
        self.low[slots, 2] = floor
        self.points[slots] = points
        self.add_tools(slots, boxes, poses)
        self._write_state(slots)

    def step(self, slots: Slots, controls: Floats) -> None:
        """Move the held points by `controls` (b, C) in one control step and reward the cubes' approach to the base."""
        pose = self.pose[slots]
        length = np.maximum(1.0, np.sqrt((controls[:, IN_PLANE] ** 2).sum(axis=1)))
        move = CONTROL.bounds[1] * controls
        move[:, IN_PLANE] /= length[:, None]
        self.drive(slots, np.clip(pose + move, self.low[slots], self.high) - pose)
        self.advance(slots)
        self.read_tools(slots)
        self.read_bodies(slots)
        before = self.distance[slots]
        self._write_state(slots)
        self.set_success(slots, at_base=self.distance[slots] < GOAL_DISTANCE)
        self.set_reward(
            slots,
            progress=PROGRESS_WEIGHT * (before - self.distance[slots]),
            slack=SLACK_REWARD,
            success=SUCCESS_REWARD * self.success[slots],
        )

    def mark(self, slot: int, marks: Marks) -> None:
        """Draw the goal's edge, the overhang's outline and the held point."""
        angles = np.linspace(0.0, np.pi, 61)
        arc = GOAL_DISTANCE * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
        marks.line(arc, COLOURS["goal"])
        (left, right), (front, back) = OVERHANG_X, OVERHANG_Y
        corners = np.array([(left, front), (right, front), (right, back), (left, back), (left, front)])
        marks.line(np.pad(corners, ((0, 0), (0, 1))), COLOURS["scene"])
        marks.dot(self.pose[slot], COLOURS["background"])

    def _write_state(self, slots: Slots) -> None:
        cube, pose = self.bodies[slots, 0], self.pose[slots]
        place, velocity = cube[:, PLACE][:, XY], cube[:, VELOCITY][:, XY]
        x, y, z, w = cube[:, ROTATION].T
        # A cube looks the same after a quarter turn; sine and cosine of four times its angle about the vertical are
        # also the same.
        turn = 4.0 * np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        distance = np.sqrt((place**2).sum(axis=1))
        state = self.state
        state[slots, CUBE] = place
        state[slots, CUBE_VELOCITY] = velocity
        state[slots, TURN_COS] = np.cos(turn)
        state[slots, TURN_SIN] = np.sin(turn)
        state[slots, CUBE_DISTANCE] = distance
        state[slots, HOLD] = pose
        to_cube = (place - pose[:, XY])[:, None] - self.points[slots]
        state[slots, TO_CUBE] = to_cube.reshape(len(slots), -1)
        self.distance[slots] = self.outcome[slots] = distance


def link_turns(boxes: Boxes) -> Floats:
    """Return each link's angle from the y axis, rad, (b, K); links rotate only about the vertical."""
    return 2.0 * np.arctan2(boxes.rotations[..., 2], boxes.rotations[..., 3])


def chain_boxes(designs: Floats) -> tuple[Floats, Boxes]:
    """Return the chain's points (b, 4, 2) from the held point, at the origin, to the tip, m, and the links' boxes.

    The first link points away from the robot, along y; each joint turns the rest of the chain about the vertical.
    """
    sizes = designs[:, LINK_SIZES].reshape(-1, NUM_LINKS, len(SIZE_NAMES))
    turns = np.cumsum(np.pad(designs[:, JOINT_ANGLES], ((0, 0), (1, 0))), axis=1)
    lengths = sizes[:, :, SIZE_NAMES.index("length"), None]
    steps = lengths * np.stack([-np.sin(turns), np.cos(turns)], axis=-1)
    points = np.zeros((len(designs), NUM_LINKS + 1, 2))
    np.cumsum(steps, axis=1, out=points[:, 1:])
    centres = np.pad(0.5 * (points[:, :-1] + points[:, 1:]), ((0, 0), (0, 0), (0, 1)))
    return points, Boxes(0.5 * sizes, centres, rotations_about(2, turns))


def start_shift(boxes: Boxes, offset: Floats) -> Floats:
    """Return the shifts (b,) along x from `HOLD_START` at which tools are clear of their cubes, m.

    `offset` (b, 2) is the displacement from a cube's centre to the held point, m. The held point stays inside its box.
    """
    return nearest_clear_shift(*_blocked_shifts(boxes, offset), (HOLD_X[0] - HOLD_START[0], HOLD_X[1] - HOLD_START[0]))


def _blocked_shifts(boxes: Boxes, offset: Floats) -> tuple[Floats, Floats]:
    """Return the ends (b, K) of each link's interval of shifts at which it is too close to the cube; NaN if none.

    Seen from above, link and cube are rectangles. Two rectangles are apart if and only if their projections on at least
    one of the four directions of their sides are apart (separating axis theorem). The projections on one direction are
    too close for one interval of shifts, so the link is too close on the intersection of the four intervals.
    """
    turn = link_turns(boxes)
    across = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    along = np.stack([-np.sin(turn), np.cos(turn)], axis=-1)
    centre = boxes.centres[..., XY] + offset[:, None]
    x, y = (np.broadcast_to(axis, across.shape) for axis in ([1.0, 0.0], [0.0, 1.0]))
    ends = [_close_shadows(direction, (across, along), boxes, centre) for direction in (x, y, across, along)]
    low, high = np.maximum.reduce([low for low, _ in ends]), np.minimum.reduce([high for _, high in ends])
    apart = ~(low < high)
    return np.where(apart, np.nan, low), np.where(apart, np.nan, high)


def _close_shadows(
    direction: Floats, sides: tuple[Floats, Floats], boxes: Boxes, centre: Floats
) -> tuple[Floats, Floats]:
    """Return the ends (b, K) of the interval of shifts at which the projections of link and cube are too close.

    Args:
        direction: unit vectors (b, K, 2) of the projection.
        sides: unit vectors (b, K, 2) across and along the links.
        boxes: boxes of the tools.
        centre: centres of the links relative to the cube's centre (b, K, 2), m.
    """
    # Half the length of the cube's projection and of the link's, and the clearance between the two.
    reach = START_CLEARANCE + 0.5 * CUBE_SIZE * np.abs(direction).sum(axis=-1)
    for axis, side in enumerate(sides):
        reach = reach + boxes.half_extents[..., axis] * np.abs((direction * side).sum(axis=-1))
    middle = (direction * centre).sum(axis=-1)
    # A shift s along x moves the link's projection by slope * s.
    slope = direction[..., 0]
    tilted = np.abs(slope) > 1e-9
    divisor = np.where(tilted, slope, 1.0)
    ends = np.stack([(-reach - middle) / divisor, (reach - middle) / divisor])
    # On a direction perpendicular to x, shifts have no effect: the projections are too close at every shift, or at none
    # (NaN, which the caller's maximum and minimum propagate).
    always = np.where(np.abs(middle) < reach, np.inf, np.nan)
    return np.where(tilted, ends.min(axis=0), -always), np.where(tilted, ends.max(axis=0), always)
