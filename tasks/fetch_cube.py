"""Fetch cube: a held chain of three boxes drags a cube out from under an overhang. Docstring of `FetchCube` has more.

Shapes: `b` slots a call names, `I` = 2 instance (cube's start x, y), `D` = 11 design, `C` = 3 control, `K` = 3 links.
"""

from __future__ import annotations

import numpy as np

from codesign_bench.studies.corl2023.protocol import PROTOCOL
from codesign_bench.studies.corl2023.real_robot import REAL_ROBOT
from codesign_bench.studies.corl2023.scenes import BOX_SCENES
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
    ToolGraph,
    ToolPart,
)
from codesign_bench.task.robot import DeployedSimulator, RobotTrials

from ._bullet import MAX_SLOTS, Boxes, BulletSimulator, Camera, Marks, box_parts, rotations_about
from ._carriers import Carrier
from ._deployed import arm_carrier, gripper_handle
from ._scene import COLOURS, Clock

TABLE = BOX_SCENES["fetch_cube"]

PAPER_ORIGIN = 1.2
"""The robot's base stands at the origin and y points away from it: y = 1.2 m - y of the paper (ours).

The paper prints cube starts in two frames; this is the shift that makes its real starts -y and its fine-tuning starts
unsolved (see docs/tasks/fetch_cube.md).
"""
REGION = PROTOCOL.fetch_cube_region
CUBE_X = REGION.x
"""Starts of the cube's centre, m (paper, section "Generalization to Unseen Goals Experiment Details")."""
CUBE_Y = (PAPER_ORIGIN - REGION.y[1], PAPER_ORIGIN - REGION.y[0])
"""The same along y, in our frame, m."""
CUBE_SIZE = 0.05
"""Side of the cube, m (paper, section "Real Robot Experiment Details")."""
CUBE_MASS = 0.1
"""kg (ours)."""
GOAL_DISTANCE = 0.5
"""The cube is fetched when its centre is closer to the robot's base than this, m (paper, the same section)."""

HOLD_START = np.array(TABLE.tool_position_init)
"""Where the held point starts, m (paper, table of fetch cube)."""
HOLD_X, HOLD_Y = (-0.4, 0.4), (0.3, 0.5)
"""Where the held point may go, m: 0.8 m x 0.2 m (paper) before the overhang's edge (place ours)."""
HOLD_TOP = 0.04
"""Highest place of the held point, m (ours): a thin tool meets the cube's side, never its top."""
GROUND_CLEARANCE = 0.001
"""Between the tallest link and the table, m (ours)."""
START_CLEARANCE = 0.005
"""A tool that would start closer to the cube than this starts left or right of there, whichever is nearer, m (ours)."""
STEP_LENGTH = 0.02
"""Largest move of the held point in one control step, in the plane and vertically, m (ours).

The paper's action scale would be 0.1: at 2.4 m/s cubes are shot from the table.
"""

OVERHANG_Y = (0.5, 1.1)
"""Where the overhang hides the table, m (ours)."""
OVERHANG_X = (-0.75, 0.75)
"""m (ours): wider than any tool reaches with its held point in its box."""
OVERHANG_HEIGHT = 0.08
"""Of its underside above the table, m (ours): 2 cm above any tool."""
OVERHANG_THICKNESS = 0.02
"""m (ours)."""
TABLE_FRICTION = 0.5
"""Between cube and table (ours)."""
TOOL_FRICTION = 0.7
"""Between cube and tool (ours): lets the cube be dragged by a link at up to 35 degrees from square."""

PROGRESS_WEIGHT = 10.0
"""Reward per metre that the cube comes nearer (ours)."""

CLOCK = Clock(steps=TABLE.control_steps_per_action, period=1.0 / 240.0)
"""Ten physics steps per control step (paper) of PyBullet's own default length, s."""

SIZES = tuple(
    (2.0 * low, 2.0 * high) for low, high in zip(TABLE.box_dimensions_min, TABLE.box_dimensions_max, strict=True)
)
"""Width, length and height of a link, m: the table's numbers are read as half extents (ours)."""
ANGLES = tuple(float(np.deg2rad(bound)) for bound in (TABLE.tool_angle_min[0], TABLE.tool_angle_max[0]))
"""Of a joint, rad (paper)."""
NUM_LINKS = 3

ARM_BASE = (0.0, 0.0, 0.0)
"""Where a robot's base stands, m: at the origin (paper), on the table (ours)."""
ARM_CAMERA = Camera(eye=(0.0, 1.75, 1.0), target=(0.0, 0.38, 0.16))
"""Sees arm and cube in deployment: from behind the overhang."""


def _design_space() -> Box:
    entries = {}
    for link in range(1, NUM_LINKS + 1):
        for what, (low, high) in zip(("width", "length", "height"), SIZES, strict=True):
            entries[f"link_{link}_{what}"] = (low, high, "m")
    return Box.of(**entries, joint_1_angle=(ANGLES[0], ANGLES[1], "rad"), joint_2_angle=(ANGLES[0], ANGLES[1], "rad"))


class FetchCube(Task):
    """Fetch a cube from under an overhang (paper, section "Environments" and appendix "Environment Details").

    The robot holds one end of a chain of three boxes and moves it, without turning it, in a box of 0.8 m x 0.2 m before
    the overhang. The cube lies beneath the overhang and must come closer than 0.5 m
    to the robot's base, at the origin; y points away from the robot. The tool meets the cube's sides alone, so a link
    must stand behind the cube, and the cube's start decides which: a hook for the middle, a chain that is bent inwards
    for the sides. One pull moves the cube by at most 0.2 m; cubes further away must be pulled twice, the second time by
    a part of the tool closer to the hand.

    Action space
        Design, 11: width, length and height of three links, 0.01 to 0.03 m, 0.1 to 0.2 m and 0.01 to 0.04 m (paper,
        table of fetch cube, read as half extents), and the two angles between them, +-90 degrees (paper). Control, 3:
        change of the held point's position (paper), at most 0.02 m in the plane and 0.02 m vertically in a control step
        (ours; faster tools shoot the cube away).

    Observation
        | index | what | unit | range |
        | --- | --- | --- | --- |
        | 0, 1 | cube position x, y | m | -1.5 .. 1.5 and -1 .. 2 |
        | 2, 3 | cube velocity x, y | m/s | -2 .. 2 |
        | 4, 5 | cosine and sine of four times the cube's turn about the vertical | 1 | -1 .. 1 |
        | 6 | distance from cube to base | m | 0 .. 2.5 |
        | 7, 8, 9 | held point x, y, z | m | -0.45 .. 0.45, 0.25 .. 0.55 and 0 .. 0.05 |
        | 10 .. 17 | from the held point, the two joints and the tip to the cube, x and y of each | m | -2 .. 2 |
        | 18, 19 | start of the cube x, y | m | -0.395 .. 0.395 and 0.5 .. 0.8 |

        followed by the design (11, normalised) and the phase (3). Before there is a tool its joints and its tip count
        as lying at the held point.

    Design space
        `FetchCube.design_space`, full widths, lengths and heights.

    Goal space
        Starts of the cube, uniform in [-0.395, 0.395] x [0.5, 0.8] m (paper, in our frame: y = 1.2 m - y of the paper).

    Reward
        10 (d_before - d_after) - 0.001 per control step, d the distance from cube to base in m; +10 on success (both
        constants but the 10 per metre from the paper's table). An episode's return lies below 15.

    Starting state
        Cube at rest at its start; held point at (0, 0.5, 0.02) m (paper), raised if a link is too high for that. A tool
        that would then be closer to the cube than 0.005 m starts at the nearest place to the left or right of there
        that is not (ours).

    Episode end
        Success: the cube's centre is closer than 0.5 m to the base (paper). Time limit: 100 control steps (paper) of
        1/24 s.
    """

    name = "fetch_cube"
    title = "Fetch cube"
    horizon = TABLE.max_episode_steps
    control_period = CLOCK.control_period
    design_space = _design_space()
    tool_graph = ToolGraph(
        num_nodes=NUM_LINKS, edges=((0, 1), (1, 2)), parameter_nodes=(0, 0, 0, 1, 1, 1, 2, 2, 2, 1, 2)
    )
    control_space = Box.of(
        move_x=(-STEP_LENGTH, STEP_LENGTH, "m"),
        move_y=(-STEP_LENGTH, STEP_LENGTH, "m"),
        move_z=(-STEP_LENGTH, STEP_LENGTH, "m"),
    )
    instance_space = Box.of(cube_start_x=(*CUBE_X, "m"), cube_start_y=(*CUBE_Y, "m"))
    goal_size = 2
    state_space = Box.of(
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
        hold_to_cube_x=(-2.0, 2.0, "m"),
        hold_to_cube_y=(-2.0, 2.0, "m"),
        joint_1_to_cube_x=(-2.0, 2.0, "m"),
        joint_1_to_cube_y=(-2.0, 2.0, "m"),
        joint_2_to_cube_x=(-2.0, 2.0, "m"),
        joint_2_to_cube_y=(-2.0, 2.0, "m"),
        tip_to_cube_x=(-2.0, 2.0, "m"),
        tip_to_cube_y=(-2.0, 2.0, "m"),
    )

    outcome = Quantity("distance from cube to base", "m")
    max_slots = MAX_SLOTS
    soundness = Soundness(overlap=0.006, speed=0.8, outcome_change=0.01)

    def in_cutout(self, instances: Floats, fraction: float) -> Booleans:
        """Tell which starts (b, I) lie in the two patches that cover `fraction` of the training region.

        The paper's patches are the left and the right half of the region, each shrunk about its centre: those that it
        prints cover 0.597, so we read them as the fraction 0.6 and scale the halves to any other (ours).
        """
        half = 0.5 * np.sqrt(fraction)
        width, depth = CUBE_X[1], CUBE_Y[1] - CUBE_Y[0]
        across = np.abs(np.abs(instances[:, 0]) - 0.5 * width) / width
        along = np.abs(instances[:, 1] - 0.5 * sum(CUBE_Y)) / depth
        result: Booleans = (across < half) & (along < half)
        return result

    def fine_tuning_instances(self) -> Floats:
        """Return the paper's four starts outside the training region, (4, I), in our frame."""
        x, y = np.array(PROTOCOL.fine_tuning_starts).T
        return np.stack([x, PAPER_ORIGIN - y], axis=1)

    def material(self, designs: Floats) -> Floats:
        """Return the used share of the largest total volume of the links for designs (b, D) in their units."""
        sizes = designs[:, : 3 * NUM_LINKS].reshape(-1, NUM_LINKS, 3)
        largest = NUM_LINKS * np.prod([high for _, high in SIZES])
        volume: Floats = sizes.prod(axis=2).sum(axis=1) / largest
        return volume

    def effort(self, controls: Floats) -> Floats:
        """Return the share of the largest move for controls (b, C) in [-1, 1]."""
        length: Floats = np.linalg.norm(controls, axis=1) / np.sqrt(controls.shape[1])
        return length

    def tool_parts(self, design: Floats) -> tuple[ToolPart, ...]:
        """Return the links of the tool of a design (D,) in its units."""
        return box_parts(chain_boxes(design[None])[1])

    def gripper_handle(self) -> tuple[ToolPart, ...]:
        """Return the bar and the post that the arm's fingers hold."""
        return gripper_handle()

    def script(self) -> Behaviour:
        """Return a script that pulls the cube with whichever side of a link it can bring behind it."""
        return _Script(self)

    def make_simulator(self, num_slots: int, refinement: int = 1) -> Simulator:
        """Return a simulator of `num_slots` cubes and tools."""
        return _FetchCubeSimulator(num_slots, self.state_space.size, CLOCK.refined(refinement))

    def robot_trials(self) -> RobotTrials:
        """Return the four starts of the paper's tools and its 3 x 4 grid, in our frame.

        The real robot's frame is turned by half a turn about the vertical, (x, y) -> (-x, -y): that makes y point away
        from the base and keeps left and right apart, as a mirror would not. The paper does not say where its grid lies:
        ours is centred on the region of starts, (0, 0.65) m, so that the row nearest to the robot passes the start of
        tool 2; at both sides it reaches 3 cm beyond the region.
        """
        own = -np.array(REAL_ROBOT.fetch_cube_starts)[:, :2]
        depth, width = REAL_ROBOT.grid_extent
        rows, columns = REAL_ROBOT.grid_shape
        y = 0.5 * sum(CUBE_Y) + np.linspace(0.5 * depth, -0.5 * depth, rows)
        x = 0.5 * sum(CUBE_X) + np.linspace(-0.5 * width, 0.5 * width, columns)
        return RobotTrials(own, np.stack(np.meshgrid(x, y), axis=-1), GOAL_DISTANCE)

    def make_deployed_simulator(self, num_slots: int, arm: str) -> DeployedSimulator:
        """Return a simulator of `num_slots` cubes whose tools are held by `arm`, seen from the side."""
        carrier = arm_carrier(arm, ARM_BASE, CLOCK)
        simulator = _FetchCubeSimulator(num_slots, self.state_space.size, CLOCK, carrier)
        simulator.camera, simulator.roofless = ARM_CAMERA, True
        return simulator


class _FetchCubeSimulator(BulletSimulator):
    """Table, overhang, cube and tool, one of each per slot."""

    camera = Camera(eye=(0.0, 0.56, 1.4), target=(0.0, 0.56, 0.0), up=(0.0, 1.0, 0.0), near=1.4 - 0.07)
    """Straight from above, with the overhang cut away."""
    room = ((-1.5, 1.5), (-1.0, 2.0), (0.4 * CUBE_SIZE, CUBE_SIZE))
    tool_friction = TOOL_FRICTION

    def __init__(self, num_slots: int, state_size: int, clock: Clock, carrier: Carrier | None = None) -> None:
        super().__init__(num_slots, state_size, num_bodies=1, clock=clock, carrier=carrier)
        self.roofless = False
        """Whether pictures leave the overhang out, which a camera at the side would not see beneath."""
        self.start = np.zeros((num_slots, 2))
        self.distance = np.zeros(num_slots)
        self.low = np.tile([HOLD_X[0], HOLD_Y[0], 0.0], (num_slots, 1))
        """(B, 3): lowest place of the held point, which depends on the tool's height."""
        self.high = np.array([HOLD_X[1], HOLD_Y[1], HOLD_TOP])
        self.points = np.zeros((num_slots, NUM_LINKS + 1, 2))
        """(B, 4, 2): the chain from the held point; all zero before there is a tool."""

    def begin(self, slots: Slots, instances: Floats) -> None:
        """Put cubes where `instances` (b, I) say and held points at their start."""
        self.start[slots] = instances
        self.pose[slots] = HOLD_START
        self.points[slots] = 0.0
        self.reward[slots] = 0.0
        self.success[slots] = False
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
        poses[:, 0] += start_shift(boxes, HOLD_START[:2] - self.start[slots])
        poses[:, 2] = np.maximum(poses[:, 2], floor)
        self.low[slots, 2] = floor
        self.points[slots] = points
        self.add_tools(slots, boxes, poses)
        self._write_state(slots)

    def step(self, slots: Slots, controls: Floats) -> None:
        """Move the held points by `controls` (b, C) in one control step and reward the cubes' way to the base."""
        pose = self.pose[slots]
        plane = np.maximum(1.0, np.sqrt((controls[:, :2] ** 2).sum(axis=1)))
        move = STEP_LENGTH * controls
        move[:, :2] /= plane[:, None]
        self.drive(slots, np.clip(pose + move, self.low[slots], self.high) - pose)
        self.advance(slots)
        self.read_tools(slots)
        self.read_bodies(slots)
        before = self.distance[slots]
        self._write_state(slots)
        self.success[slots] = self.distance[slots] < GOAL_DISTANCE
        self.reward[slots] = (
            PROGRESS_WEIGHT * (before - self.distance[slots])
            + TABLE.slack_reward
            + TABLE.success_reward * self.success[slots]
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
        x, y, z, w = cube[:, 3:7].T
        turn = 4.0 * np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        distance = np.sqrt((cube[:, :2] ** 2).sum(axis=1))
        state = self.state
        state[slots, 0:2] = cube[:, :2]
        state[slots, 2:4] = cube[:, 7:9]
        state[slots, 4] = np.cos(turn)
        state[slots, 5] = np.sin(turn)
        state[slots, 6] = distance
        state[slots, 7:10] = pose
        to_cube = (cube[:, :2] - pose[:, :2])[:, None] - self.points[slots]
        state[slots, 10:] = to_cube.reshape(len(slots), -1)
        self.distance[slots] = self.outcome[slots] = distance


class _Script(Behaviour):
    """Brings a side of a link behind the cube as seen from the base, then pulls towards the base.

    Every link has a few places on both of its sides. The one is taken that lets the cube go furthest before the held
    point leaves its box, is near, and can be reached around the cube: straight, first sideways or first along y. The
    choice is made anew in every step, so that a place further down the link follows when a pull has come to its end.
    """

    LINK = (0.02, 0.03)
    """Width and height of every link of its tools, m."""
    HOOK, BENT, BAR = (0.0, -90.0), (-45.0, -45.0), (-65.0, 0.0)
    """Angles of its tools, degrees: for cubes in the middle, at the side, and far away. Left ones get mirror images."""
    HOOK_BEHIND = 0.045
    """The hook starts so far behind the cube's centre if the links are long enough for that, m."""
    FAR, ASIDE = 0.7, 0.22
    """Cubes at larger y are far ones, cubes at larger abs(x) lie at the side, m."""

    PLACES_PER_LINK = 4
    CONSIDERED = 8
    """For so many places the ways there are looked at."""
    WAY_POINTS = 8
    GAP = 0.004
    """Between link and cube until a pull begins, m."""
    DISC = 0.027
    """On its way a link keeps this far from the cube's centre, m."""
    FACING = 0.75
    """Smallest cosine between a link's side and the pull, within the friction's cone."""
    DETOURS = (0.0, 0.05, 0.05, 0.1)
    """What the paths cost: straight, first sideways, first along y, first back."""
    INSIDE = 0.03
    """The cube is pulled this far beyond the goal's edge, m."""

    def __init__(self, task: FetchCube) -> None:
        self.task = task

    def design(self, observation: Singles) -> Singles:
        """Return a hook, a bent chain or a bar by the cube's place."""
        cube = np.atleast_2d(observation)[:, :2].astype(np.float64)
        far, aside = cube[:, 1] > self.FAR, np.abs(cube[:, 0]) > self.ASIDE
        shape = np.where(far, 2, np.where(aside, 1, 0))
        reach = 0.5 * (cube[:, 1] + self.HOOK_BEHIND - HOLD_START[1])
        short, long = SIZES[1]
        lengths = np.full((len(cube), NUM_LINKS), long)
        lengths[:, 0] = np.where(far, long, np.where(aside, short, np.clip(reach, short, long)))
        lengths[:, 1] = np.where(far, long, lengths[:, 0])
        designs = np.zeros((len(cube), self.task.design_space.size))
        for link in range(NUM_LINKS):
            designs[:, 3 * link : 3 * link + 3] = np.pad(lengths[:, link, None], ((0, 0), (1, 1)))
            designs[:, [3 * link, 3 * link + 2]] = self.LINK
        angles = np.deg2rad([self.HOOK, self.BENT, self.BAR])[shape]
        designs[:, 3 * NUM_LINKS :] = np.where(cube[:, :1] < 0.0, -angles, angles)
        result: Singles = self.task.design_space.to_unit(designs).astype(np.float32)
        return result if observation.ndim == 2 else result[0]

    def act(self, observation: Singles) -> Singles:
        """Return the held point's move, normalised."""
        seen = np.atleast_2d(observation).astype(np.float64)
        cube, hold = seen[:, 0:2], seen[:, 7:9]
        pull = -cube / np.linalg.norm(cube, axis=1, keepdims=True)
        _, boxes = chain_boxes(self.task.design_space.from_unit(seen[:, self.task.layout.design]))
        ways, score = self._ways(cube, hold, pull, 0.25 * np.arctan2(seen[:, 5], seen[:, 4]), boxes)
        paths = _paths(ways, HOLD_Y[0] - hold[:, 1], self.WAY_POINTS)
        blocked = np.clip(
            1.0 - _gaps(cube[:, None, None, None] - hold[:, None, None, None] - paths, boxes) / self.DISC, 0, 1
        )
        total = (score[:, :, None] - blocked.max(axis=3) - self.DETOURS).reshape(len(seen), -1)
        choice, rows = total.argmax(axis=1), np.arange(len(seen))
        way, kind = ways[rows, choice // len(self.DETOURS)], choice % len(self.DETOURS)
        leg = way.copy()
        leg[(kind == 1) & (np.abs(way[:, 0]) > self.GAP), 1] = 0.0
        leg[(kind == 2) & (np.abs(way[:, 1]) > self.GAP), 0] = 0.0
        leg[kind == 3] = (0.0, -1.0)
        there = np.linalg.norm(way, axis=1, keepdims=True) < 3.0 * self.GAP
        move = np.where(there, 0.5 * way / STEP_LENGTH + pull, leg / STEP_LENGTH)
        controls = np.zeros((len(seen), 3), dtype=np.float32)
        controls[:, :2] = move / np.maximum(1.0, np.linalg.norm(move, axis=1, keepdims=True))
        return controls if observation.ndim == 2 else controls[0]

    def _ways(self, cube: Floats, hold: Floats, pull: Floats, turn: Floats, boxes: Boxes) -> tuple[Floats, Floats]:
        """Return the held point's ways (B, P, 2) to the best places for a pull, and how good these are, (B, P)."""
        places, sides = self._places(turn, boxes)
        held = cube[:, None] - places
        low, high = np.array([HOLD_X[0], HOLD_Y[0]]), np.array([HOLD_X[1], HOLD_Y[1]])
        with np.errstate(divide="ignore"):
            room = np.where(pull[:, None] > 0.0, high - held, low - held) / pull[:, None]
        needed = np.linalg.norm(cube, axis=1, keepdims=True) - GOAL_DISTANCE + self.INSIDE
        facing = (sides * pull[:, None]).sum(axis=2)
        gain = np.clip(np.minimum(room.min(axis=2), needed), 0.0, None) * facing * (facing > self.FACING)
        ways = held - hold[:, None]
        missed = np.linalg.norm(np.clip(held, low, high) - held, axis=2)
        score = 10.0 * gain - np.linalg.norm(ways, axis=2) - 20.0 * missed
        best = np.argsort(-score, axis=1)[:, : self.CONSIDERED]
        return np.take_along_axis(ways, best[..., None], axis=1), np.take_along_axis(score, best, axis=1)

    def _places(self, turn: Floats, boxes: Boxes) -> tuple[Floats, Floats]:
        """Return where the cube's centre may lie beside links, from the held point, and the links' sides (B, P, 2)."""
        heading = _turns(boxes)
        normal = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        along = np.stack([-normal[..., 1], normal[..., 0]], axis=-1)
        share = (2.0 * np.arange(self.PLACES_PER_LINK) + 1.0) / self.PLACES_PER_LINK - 1.0
        middle = boxes.centres[:, :, None, :2] + (boxes.half_extents[..., 1:2] * share)[..., None] * along[:, :, None]
        skew = heading - turn[:, None]
        reach = boxes.half_extents[..., 0] + 0.5 * CUBE_SIZE * (np.abs(np.cos(skew)) + np.abs(np.sin(skew))) + self.GAP
        away = (normal * reach[..., None])[:, :, None]
        shape = (len(turn), -1, 2)
        sides = np.repeat(normal, self.PLACES_PER_LINK, axis=1)
        places = np.concatenate([(middle + away).reshape(shape), (middle - away).reshape(shape)], axis=1)
        return places, np.concatenate([sides, -sides], axis=1)


def _paths(ways: Floats, back: Floats, count: int) -> Floats:
    """Return (B, P, 4, count, 2) points on four paths along each of `ways` (B, P, 2), after `count` equal times.

    They lead straight there, first along x, first along y, and first `back` (B,) along y, then along x.
    """
    share = (np.arange(count) + 1.0) / count
    early, late = np.clip(2.0 * share, 0.0, 1.0), np.clip(2.0 * share - 1.0, 0.0, 1.0)
    shares = np.stack([[share, share], [early, late], [late, early], [np.clip(1.5 * share - 0.25, 0.0, 1.0), late]])
    paths: Floats = ways[:, :, None, None] * shares.transpose(0, 2, 1)
    paths[:, :, 3, :, 1] += back[:, None, None] * np.minimum(4.0 * share, np.minimum(1.0, 2.0 - 2.0 * share))
    return paths


def _gaps(points: Floats, boxes: Boxes) -> Floats:
    """Return how far `points` (B, ..., 2), seen from the held point, are from the nearest link, m; negative inside."""
    heading, nearest = _turns(boxes), np.full(points.shape[:-1], np.inf)
    widen = (slice(None),) + (None,) * (points.ndim - 2)
    for link in range(NUM_LINKS):
        offset = points - boxes.centres[:, link, :2][widen]
        cos, sin = np.cos(heading[:, link])[widen], np.sin(heading[:, link])[widen]
        half = boxes.half_extents[:, link]
        across = np.abs(cos * offset[..., 0] + sin * offset[..., 1]) - half[:, 0][widen]
        along = np.abs(cos * offset[..., 1] - sin * offset[..., 0]) - half[:, 1][widen]
        outside = np.hypot(np.maximum(across, 0.0), np.maximum(along, 0.0))
        nearest = np.minimum(nearest, outside + np.minimum(np.maximum(across, along), 0.0))
    return nearest


def _turns(boxes: Boxes) -> Floats:
    """Return how far each link is turned from the y axis, rad, (b, K)."""
    return 2.0 * np.arctan2(boxes.rotations[..., 2], boxes.rotations[..., 3])


def chain_boxes(designs: Floats) -> tuple[Floats, Boxes]:
    """Return the chain's points (b, 4, 2) from the held point, at the origin, to the tip, m, and the links' boxes.

    The first link points away from the robot, along y; each joint turns the rest of the chain about the vertical.
    """
    sizes = designs[:, : 3 * NUM_LINKS].reshape(-1, NUM_LINKS, 3)
    turns = np.cumsum(np.pad(designs[:, 3 * NUM_LINKS :], ((0, 0), (1, 0))), axis=1)
    steps = sizes[:, :, 1, None] * np.stack([-np.sin(turns), np.cos(turns)], axis=-1)
    points = np.zeros((len(designs), NUM_LINKS + 1, 2))
    np.cumsum(steps, axis=1, out=points[:, 1:])
    centres = np.pad(0.5 * (points[:, :-1] + points[:, 1:]), ((0, 0), (0, 0), (0, 1)))
    return points, Boxes(0.5 * sizes, centres, rotations_about(2, turns))


def start_shift(boxes: Boxes, offset: Floats) -> Floats:
    """Return how far (b,) tools must start from `HOLD_START` along x to be clear of their cubes, in m.

    `offset` (b, 2) leads from a cube's centre to the held point. Along x, a link is too close over one interval; the
    tool starts at the place nearest to no shift that lies in no link's interval and inside the held point's box.
    """
    low, high = _blocked_shifts(boxes, offset)
    candidates = np.concatenate([np.zeros((len(low), 1)), low, high], axis=1)
    inside = (candidates[:, :, None] > low[:, None] + 1e-9) & (candidates[:, :, None] < high[:, None] - 1e-9)
    outside = np.abs(candidates + HOLD_START[0]) > HOLD_X[1]
    distance = np.where(inside.any(axis=2) | outside | np.isnan(candidates), np.inf, np.abs(candidates))
    result: Floats = candidates[np.arange(len(low)), distance.argmin(axis=1)]
    return result


def _blocked_shifts(boxes: Boxes, offset: Floats) -> tuple[Floats, Floats]:
    """Return the ends (b, K) of each link's interval of shifts at which it is too close to the cube; NaN if none.

    Seen from above, link and cube are rectangles. They are apart when their shadows on one of the four directions of
    their sides are; on each direction the shadows are too close over one interval, and the link is over what is common
    to all four.
    """
    half = 0.5 * CUBE_SIZE
    turn = _turns(boxes)
    across = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    along = np.stack([-np.sin(turn), np.cos(turn)], axis=-1)
    centre = boxes.centres[..., :2] + offset[:, None]
    lows, highs = [], []
    for direction in (
        np.broadcast_to([1.0, 0.0], across.shape),
        np.broadcast_to([0.0, 1.0], across.shape),
        across,
        along,
    ):
        reach = START_CLEARANCE + half * np.abs(direction).sum(axis=-1)
        for side, axis in ((0, across), (1, along)):
            reach = reach + boxes.half_extents[..., side] * np.abs((direction * axis).sum(axis=-1))
        middle = (direction * centre).sum(axis=-1)
        slope = direction[..., 0]
        tilted = np.abs(slope) > 1e-9
        divisor = np.where(tilted, slope, 1.0)
        ends = np.stack([(-reach - middle) / divisor, (reach - middle) / divisor])
        always = np.where(np.abs(middle) < reach, np.inf, np.nan)
        lows.append(np.where(tilted, ends.min(axis=0), -always))
        highs.append(np.where(tilted, ends.max(axis=0), always))
    low, high = np.maximum.reduce(lows), np.minimum.reduce(highs)
    apart = ~(low < high)
    return np.where(apart, np.nan, low), np.where(apart, np.nan, high)
