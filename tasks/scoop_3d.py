"""Scoop 3D: a scoop is lifted out of a reservoir with as many balls as are wanted. Docstring of `Scoop3D` has more.

Shapes: `b` slots a call names, `I` = 2 instance (balls wanted, pile), `D` = 10 design, `C` = 6 control, `N` = 40 balls,
`P` = 4 side plates (back, front, left, right), `K` = 6 boxes of a tool, `M` = 49 places of the profile of a pile.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np

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
    Shape,
    Simulator,
    Slots,
    Soundness,
    Task,
    ToolGraph,
    ToolPart,
    constants,
)

from ._bullet import (
    BULLET_SCENE,
    LEVEL,
    PLACE,
    VELOCITY,
    Boxes,
    BulletSimulator,
    Triple,
    box_parts,
    rotation_matrices,
    rotations_about,
)
from ._carriers import MISSING, pybullet
from ._marks import Camera, Marks
from ._scene import COLOURS, Clock

PAPER = "paper, table of 3D scoop"
TEXT = 'paper, appendix "Environment Details"'

BALLS: Annotated[int, Given("balls", TEXT)] = 40
"""Number of balls in the reservoir."""
WANTED: Annotated[tuple[int, int], Given("balls", TEXT)] = (1, 7)
"""Smallest and largest requested number of balls."""

BOX_MIN: Annotated[Triple, Given("m", PAPER, "box_dimensions_min")] = (0.04, 0.005, 0.02)
"""Smallest width, thickness and height of a plate, read as half extents, as PyBullet does (our reading)."""
BOX_MAX: Annotated[Triple, Given("m", PAPER, "box_dimensions_max")] = (0.08, 0.005, 0.05)
"""Largest width, thickness and height of a plate, read as half extents (our reading)."""
HALF_THICKNESS = BOX_MIN[1]
"""Half thickness of a plate, m: the paper's smallest and largest are the same."""
ANGLE_MIN: Annotated[float, Given("degrees", PAPER, "tool_angle_min")] = -15.0
"""Smallest outward lean of a side plate."""
ANGLE_MAX: Annotated[float, Given("degrees", PAPER, "tool_angle_max")] = 15.0
"""Largest outward lean of a side plate."""
HANDLE_HALF_EXTENTS: Annotated[Triple, Given("m", OURS)] = (0.01, HALF_THICKNESS, 0.1)
"""Half extents of the handle."""
HANDLE_LEAN: Annotated[float, Given("rad", OURS)] = np.deg2rad(30.0)
"""Outward lean of the handle from the back plate, so that it is never above the opening."""
TOOL_MASS: Annotated[float, Given("kg", OURS)] = 0.2
"""Mass of the tool."""
PUSH_FORCE: Annotated[float, Given("N", OURS)] = 20.0
"""Largest force of a sliding joint of the gantry."""
TURN_TORQUE: Annotated[float, Given("N m", OURS)] = 2.0
"""Largest torque of a turning joint of the gantry."""

BALL_RADIUS: Annotated[float, Given("m", OURS)] = 0.029
"""Radius of a ball: tools hold 1 to 15 balls."""
BALL_MASS: Annotated[float, Given("kg", OURS)] = 0.05
"""Mass of a ball."""
FRICTION: Annotated[float, Given("1", OURS)] = 0.3
"""Friction of balls, plates, walls and floor. PyBullet multiplies the coefficients of the two bodies, so a contact has
0.09: slippery balls do not pile up above the rim."""
TOOL_FRICTION: Annotated[float, Given("1", OURS)] = FRICTION
"""Friction of the tool's surface."""
LINEAR_DAMPING: Annotated[float, Given("1/s", OURS)] = 0.1
"""Fraction of its speed that a ball loses per second."""
ANGULAR_DAMPING: Annotated[float, Given("1/s", OURS)] = 0.5
"""Fraction of its spin that a ball loses per second."""
RESERVOIR: Annotated[tuple[float, float], Given("m", OURS)] = (0.22, 0.255)
"""Half the inner size of the reservoir along x and y: a ball fits between any tool and a wall."""
WALL_HEIGHT: Annotated[float, Given("m", OURS)] = 0.1
"""Height of the reservoir's walls."""
WALL_HALF_THICKNESS: Annotated[float, Given("m", OURS)] = 0.01
"""Half thickness of the reservoir's walls."""
FLOOR_PICTURE = (1.0, 1.0, 0.01)
"""Half extents of the drawn part of the infinite floor, m (ours)."""
FLOOR_COLOUR = "#e4e6ea"
"""Colour of the floor (ours)."""
LINE: Annotated[float, Given("m", OURS)] = 0.13
"""A tool whose lowest point is above this is clear of the reservoir."""

FLOOR_CLEARANCE: Annotated[float, Given("m", OURS)] = 0.004
"""Gap between floor and bottom plate at the start, and smallest allowed gap."""
TOOL_START: Annotated[Triple, Given("m", f"{PAPER}; z ours", "tool_position_init")] = (
    0.0,
    0.05,
    FLOOR_CLEARANCE + HALF_THICKNESS,
)
"""Start of the centre of the bottom plate: the paper's z is above the balls, ours is among them."""
REACH: Annotated[tuple[float, float], Given("m", OURS)] = (0.03, 0.03)
"""Largest distance of the tool from its start along x and y."""
HIGHEST: Annotated[float, Given("m", OURS)] = 0.2
"""Largest height of the centre of the bottom plate."""
LARGEST_TURN: Annotated[Triple, Given("rad", OURS)] = (0.25, 0.25, 0.3)
"""Largest rotations about x, y and z: the tool cannot be emptied, so its shape determines the number of balls."""
CONTROL_MIN: Annotated[tuple[float, ...], Given("1", PAPER, "control_action_min")] = (-1.0,) * 3 + (-1.57,) * 3
"""Lower bounds of a control along and about x, y and z, before scaling."""
CONTROL_MAX: Annotated[tuple[float, ...], Given("1", PAPER, "control_action_max")] = (1.0,) * 3 + (1.57,) * 3
"""Upper bounds of a control, before scaling."""
CONTROL_SCALE: Annotated[float, Given("m, rad", OURS, "control_action_scale")] = 0.015
"""Scales a control to a change of pose per control step: 0.45 m/s and 0.71 rad/s. The paper's scale would be 1.5 m/s
and 2.4 rad/s, which throws balls around."""

PILES: Annotated[int, Given("piles", OURS)] = 2**20
"""Number of different piles."""
POUR_COLUMNS: Annotated[int, Given("balls", OURS)] = 3
"""Balls at the tool's start are poured onto it in layers of this number squared."""
POUR_GAP: Annotated[float, Given("m", OURS)] = 0.004
"""Gap between balls before they are poured."""
SETTLING_STEPS: Annotated[int, Given("control steps", OURS)] = 16
"""Control steps in which poured balls come to rest before the first control."""

HELD_SPEED: Annotated[float, Given("m/s", OURS)] = 0.5
"""Largest speed of a held ball in the frame of the tool."""
HELD_STEPS: Annotated[int, Given("control steps", OURS)] = 6
"""Consecutive control steps for which the requested number must be held."""
LOST_STEPS: Annotated[int, Given("control steps", OURS)] = 30
"""Control steps for which a tool may be clear of the reservoir without success."""
PROGRESS_REWARD: Annotated[float, Given("1", OURS)] = 5.0
"""Scale of the potential."""
CLOSENESS_POWER: Annotated[float, Given("1", OURS)] = 1.5
"""Exponent of the potential: how much a wrong number costs."""
SLACK_REWARD: Annotated[float, Given("1", PAPER, "slack_reward")] = -0.001
"""Added in every control step."""
SUCCESS_REWARD: Annotated[float, Given("1", PAPER, "success_reward")] = 10.0
"""Added once, when the requested number is held."""

HORIZON: Annotated[int, Given("control steps", PAPER, "max_episode_steps")] = 100
"""Time limit."""
STEPS_PER_CONTROL: Annotated[int, Given("physics steps", OURS, "control_steps_per_action")] = 4
"""In a control step."""
PHYSICS_PERIOD: Annotated[float, Given("s", OURS)] = 1.0 / 120.0
"""Of a physics step."""
CLOCK = Clock(STEPS_PER_CONTROL, PHYSICS_PERIOD)
SOLVER_ITERATIONS: Annotated[int, Given("1", OURS)] = 10
"""Of the contact solver in every physics step."""
CONTACT_CORRECTION: Annotated[float, Given("1", OURS)] = 0.5
"""Fraction of an overlap that a physics step removes."""

PROFILE_POINTS: Annotated[int, Given("1", OURS)] = 7
"""Along x and along y the policies see how high the balls lie at so many places."""
PROFILE_STEP: Annotated[float, Given("m", OURS)] = 0.04
"""Between neighbouring places: less than a ball is wide, more than its radius."""

SIDES = ("back", "front", "left", "right")
BACK = SIDES.index("back")
SIDE_NODES = (1, 3, 4, 5)
"""Nodes of the side plates in the tool graph."""
OUTWARDS = np.array([[0.0, -1.0], [0.0, 1.0], [-1.0, 0.0], [1.0, 0.0]])
"""(P, 2) directions of the side plates from the centre of the bottom plate."""


(_WIDTH, _, _HEIGHT) = ((2.0 * low, 2.0 * high, "m") for low, high in zip(BOX_MIN, BOX_MAX, strict=True))
_ANGLE = (float(np.deg2rad(ANGLE_MIN)), float(np.deg2rad(ANGLE_MAX)), "rad")
DESIGN = Box.of(
    bottom_width=_WIDTH,
    bottom_length=_WIDTH,
    **{f"{side}_height": _HEIGHT for side in SIDES},
    **{f"{side}_angle": _ANGLE for side in SIDES},
)
BOTTOM_WIDTH, BOTTOM_LENGTH = DESIGN.index("bottom_width"), DESIGN.index("bottom_length")
BOTTOM = DESIGN.slice("bottom_width", "bottom_length")
"""Size of the bottom plate along x and y."""
HEIGHTS, ANGLES = (DESIGN.slice(*(f"{side}_{what}" for side in SIDES)) for what in ("height", "angle"))

CONTROL = Box(
    names=("move_x", "move_y", "move_z", "turn_x", "turn_y", "turn_z"),
    low=tuple(CONTROL_SCALE * bound for bound in CONTROL_MIN),
    high=tuple(CONTROL_SCALE * bound for bound in CONTROL_MAX),
    units=("m", "m", "m", "rad", "rad", "rad"),
)
MOVE_UP, TURNS = CONTROL.index("move_z"), CONTROL.group("turn_")
INSTANCE = Box.of(balls_wanted=(float(WANTED[0]), float(WANTED[1]), "balls"), pile=(0.0, PILES - 1.0, "1"))
BALLS_WANTED, PILE = INSTANCE.index("balls_wanted"), INSTANCE.index("pile")
STATE = Box.of(
    tool_x=(-0.1, 0.1, "m"),
    tool_y=(-0.1, 0.2, "m"),
    tool_z=(-0.1, 0.3, "m"),
    turn_x=(-0.5, 0.5, "rad"),
    turn_y=(-0.5, 0.5, "rad"),
    turn_z=(-0.5, 0.5, "rad"),
    way_to_line=(-0.3, 0.3, "m"),
    balls_above=(0.0, BALLS, "balls"),
    balls_held=(0.0, BALLS, "balls"),
    balls_missing=(-BALLS, BALLS, "balls"),
    held_share=(0.0, 1.0, "1"),
    clear_share=(0.0, 1.0, "1"),
    centre_x=(-0.2, 0.2, "m"),
    centre_y=(-0.2, 0.2, "m"),
    highest_ball=(0.0, 0.5, "m"),
    **{f"wants_{count}": (0.0, 1.0, "1") for count in range(WANTED[0], WANTED[1] + 1)},
    **{f"surface_{place}": (0.0, 0.6, "m") for place in range(1, PROFILE_POINTS**2 + 1)},
    **{f"rise_{place}": (-4.0, 4.0, "m/s") for place in range(1, PROFILE_POINTS**2 + 1)},
)
TOOL_PLACE, TOOL_TURN = STATE.group("tool_"), STATE.group("turn_")
WAY_TO_LINE, BALLS_ABOVE, BALLS_HELD = (STATE.index(name) for name in ("way_to_line", "balls_above", "balls_held"))
BALLS_MISSING, HELD_SHARE = STATE.index("balls_missing"), STATE.index("held_share")
CLEAR_SHARE, CENTRE, HIGHEST_BALL = STATE.index("clear_share"), STATE.group("centre_"), STATE.index("highest_ball")
WANTS, SURFACE, RISE = STATE.group("wants_"), STATE.group("surface_"), STATE.group("rise_")
PROFILE_START = -0.5 * PROFILE_STEP * (PROFILE_POINTS - 1)
"""x and y of the first place, from the middle of the bottom plate, m; places go along y, then along x."""

POSE_PLACE, POSE_TURN = slice(0, 3), slice(3, 6)
"""Axes of a tool's pose: x, y, z (m), and turns about them (rad)."""


def _ball_picture(rings: int = 6, columns: int = 9) -> tuple[list[list[float]], list[int]]:
    """Return vertices and triangles of a coarse ball; PyBullet's fine ball takes 0.3 ms each to create."""
    tilt, turn = np.meshgrid(np.linspace(0.0, np.pi, rings), np.linspace(0.0, 2.0 * np.pi, columns), indexing="ij")
    points = np.stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)], axis=-1)
    corner = (np.arange(rings - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    upper = np.stack([corner, corner + columns, corner + 1], axis=1)
    lower = np.stack([corner + 1, corner + columns, corner + columns + 1], axis=1)
    return (BALL_RADIUS * points.reshape(-1, 3)).tolist(), np.concatenate([upper, lower]).ravel().tolist()


BALL_PICTURE = _ball_picture()
"""Vertices (m) and triangles of a ball in pictures."""
BALL_OUTLINE = Shape("ball", COLOURS["object"], ((0.0, 0.0, 0.0),), (BALL_RADIUS,))
FLOOR_OUTLINE = Shape("box", FLOOR_COLOUR, ((0.0, 0.0, -FLOOR_PICTURE[2]),), FLOOR_PICTURE, LEVEL)
"""Balls and floor in drawings outside of Python."""


class Scoop3D(Task):
    """Scoop a requested number of balls out of a reservoir (paper, appendix "Environment Details").

    The tool is a scoop of six links: a rectangular bottom plate, a plate on each of its four sides, and a handle on the
    back plate. It starts on the floor of the reservoir, among the balls and overfilled; balls that do not fit roll off
    on the way up. The tool can be rotated only a little, so the room between its plates determines how many balls stay
    on it, and every number needs a different tool.

    Action space
        Design, 10: width and length of the bottom plate (m), heights of the back, front, left and right plates (m), and
        how far each of these leans outwards (rad) (paper). Control, 6: change of the tool's position x, y, z (m) and of
        its rotations about x, y, z (rad) in a control step (paper; scale ours). Both are limited (ours).

    Observation
        State, 120: position x, y, z (m) and rotations about x, y, z (rad) of the bottom plate, distance from
        its lowest point up to the line (m); numbers of balls in or above the tool, held above the line, and
        missing; elapsed fractions of the control steps to success and failure; mean position of the balls in or
        above the tool, in its frame, x, y (m), and the height of the highest (m); a one-hot code of the
        requested number; and the balls, as a profile of the pile: how high the topmost ball reaches (m) at the
        places of a square grid that moves with the middle of the bottom plate, and how fast this ball rises
        (m/s). Goal, 1: the requested number. Then the design and the phase.

        The paper's policies observe positions and velocities of the balls; the profile is our form of them. It does not
        depend on the balls' order, is shorter, and shows the designer the balls around the place of the tool, before
        there is one. Sorted positions and velocities, and those of the nearest balls, jump where two balls change
        places in the order.

    Design space
        Sizes are full widths, lengths and heights: we read the paper's table as half extents, PyBullet's convention;
        its fixed entry is half the thickness of all plates. The bottom plate is joined to the four side plates, and the
        back plate to the handle, which the robot holds. The handle is fixed and leans back (ours), so that it is never
        above the opening.

    Goal space
        Integer numbers of balls (paper), with equal probability. An instance also holds the number of a pile:
        how the balls are placed and poured on the tool; it is no part of the goal, but the state shows how they
        lie.

    Reward
        The change of a potential, plus the paper's slack (negative) and the paper's bonus on success. The potential
        increases as the tool is lifted, and is larger the nearer the number of balls in or above it is to the requested
        one. It starts at 0 for any number of balls in the tool. An episode's return is below 15.

    Starting state
        The centre of the bottom plate is at the paper's position, but close to the floor: at the paper's height it
        would be above the balls. The balls are on the floor, each at a random position in its cell. Those that would
        touch the tool are poured onto it from above, and all come to rest before the first control (ours).

    Episode end
        Success when the tool is clear of the reservoir and exactly the requested number of balls has been held for a
        few control steps; failure when it has been clear for longer without success; or the time limit. A ball is held
        if it is between the side plates, above the bottom plate, and slow in the tool's frame. The condition does not
        hold while another ball is flying above the tool.
    """

    name = "scoop_3d"
    missing = MISSING
    version = 2
    title = "Scoop (3D)"
    scene: ClassVar = {**BULLET_SCENE, **constants(__name__)}
    horizon = HORIZON
    control_period = CLOCK.control_period
    design_space = DESIGN
    tool_graph = ToolGraph(
        num_nodes=6, edges=((0, 1), (1, 2), (2, 3), (2, 4), (2, 5)), parameter_nodes=(2, 2, 1, 3, 4, 5, 1, 3, 4, 5)
    )
    control_space = CONTROL
    instance_space = INSTANCE
    goal_size = 1
    state_space = STATE
    reward_terms: ClassVar = {
        "progress": f"change of {PROGRESS_REWARD:g} h (min(k + 1, n + 1) / max(k + 1, n + 1))^{CLOSENESS_POWER:g}, h "
        "the share of the way from the start to the line by which the bottom plate's lowest point has been lifted, k "
        "the number of balls in or above the tool, n the wanted number",
        "slack": f"{SLACK_REWARD:g}",
        "success": f"{SUCCESS_REWARD:g} in the step that solves the task",
    }
    success_conditions: ClassVar = {
        "clear": f"the bottom plate is nowhere lower than {LINE:g} m",
        "wanted_number": f"exactly the wanted number of balls is held, that is, in or above the tool and slower than "
        f"{HELD_SPEED:g} m/s in its frame",
        "none_flying": "no other ball is above the tool",
    }
    success_steps = HELD_STEPS
    failure_condition = f"the tool has been clear for {LOST_STEPS} control steps in all without success"

    run_settings: ClassVar[ByProfile] = {
        "laptop": {"steps": 500_000, "evaluations": 10},
        "workstation": {"steps": 1_000_000},
    }
    outcome = Quantity("balls held above the line", "balls")
    max_slots = 18  # physics costs far more than a call of the policy: as fast as more, in less memory
    # Balls that collide at up to 2.8 m/s overlap for a step of 1/120 s, also right after pouring; tools start clear of
    # all bodies. A million random steps saw overlaps of 0.56 radii and, right after pouring, 0.32 radii.
    soundness = Soundness(
        overlap=0.6 * BALL_RADIUS, speed=4.0, outcome_change=0.5, start_overlap=0.35 * BALL_RADIUS, chaotic=True
    )

    def sample_instances(self, rng: np.random.Generator, count: int) -> Floats:
        """Return (count, I) random numbers of balls and indices of piles."""
        instances = np.zeros((count, INSTANCE.size))
        instances[:, BALLS_WANTED] = rng.integers(WANTED[0], WANTED[1], size=count, endpoint=True)
        instances[:, PILE] = rng.integers(0, PILES, size=count)
        return instances

    def material(self, designs: Floats) -> Floats:
        """Return the area of the plates as a fraction of the largest, for designs (b, D) in their units."""
        largest = _area(np.array([self.design_space.high]))
        share: Floats = _area(designs) / largest
        return share

    def effort(self, controls: Floats) -> Floats:
        """Return the change of pose as a fraction of the largest, for controls (b, C) in [-1, 1]."""
        change: Floats = np.linalg.norm(controls, axis=1) / np.sqrt(controls.shape[1])
        return change

    def tool_parts(self, design: Floats) -> tuple[ToolPart, ...]:
        """Return the handle and plates of the tool of a design (D,) in its units."""
        return box_parts(scoop_boxes(design[None]))

    def script(self) -> Behaviour:
        """Return a script that lifts straight up and holds still."""
        from ._scripts.scoop_3d import Scoop3DScript  # imported here because that file imports this one

        return Scoop3DScript(self)

    def make_simulator(self, num_slots: int, refinement: int = 1) -> Simulator:
        """Return a simulator of `num_slots` reservoirs."""
        return _ScoopSimulator(num_slots, self.state_space.size, CLOCK.refined(refinement), SETTLING_STEPS)


class _ScoopSimulator(BulletSimulator):
    """A reservoir of rigid balls and a scoop on a gantry with six joints, one of each per slot."""

    camera = Camera(eye=(0.75, -0.75, 0.65), target=(0.0, 0.03, 0.08), field_of_view=40.0)
    room = ((-3.0, 3.0), (-3.0, 3.0), (0.0, 0.6))
    turning_axes = (0, 1, 2)
    push_force = PUSH_FORCE
    turn_torque = TURN_TORQUE
    tool_mass = TOOL_MASS
    contact_correction = CONTACT_CORRECTION
    tool_friction = TOOL_FRICTION
    solver_iterations = SOLVER_ITERATIONS

    def __init__(self, num_slots: int, state_size: int, clock: Clock, settling_steps: int) -> None:
        super().__init__(num_slots, state_size, num_bodies=BALLS, clock=clock)
        self.settling_steps = settling_steps
        self.wanted = np.zeros(num_slots, dtype=np.intp)
        self.piles: list[np.random.Generator] = [np.random.default_rng(0)] * num_slots
        self.designs = np.zeros((num_slots, DESIGN.size))
        self.local = np.zeros((num_slots, BALLS, 3))
        """(B, N, 3) positions of the balls in the frame of the tool."""
        self.potential = np.zeros(num_slots)
        self.clear_steps = np.zeros(num_slots, dtype=np.intp)

    def begin(self, slots: Slots, instances: Floats) -> None:
        """Fill the reservoirs with the piles of `instances` (b, I)."""
        self.forget(slots)
        self.wanted[slots] = np.rint(instances[:, BALLS_WANTED]).astype(np.intp)
        for slot, pile in zip(slots.tolist(), instances[:, PILE].tolist(), strict=True):
            self.piles[slot] = np.random.default_rng(round(pile))
        self.restart(slots)
        self.potential[slots] = self.clear_steps[slots] = 0
        self.state[slots] = 0.0
        self.state[slots, TOOL_PLACE] = TOOL_START
        self.state[slots, BALLS_MISSING] = self.wanted[slots]
        self.state[slots, WANTS] = np.arange(WANTED[0], WANTED[1] + 1) == self.wanted[slots, None]
        self._write_profile(slots, np.tile(TOOL_START[:2], (len(slots), 1)))

    def build_scene(self, slot: int) -> list[int]:
        """Build floor and walls, and put the balls next to each other on the floor."""
        world = self.worlds[slot]
        floor = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=world)
        slab = pybullet.createVisualShape(
            pybullet.GEOM_BOX,
            halfExtents=FLOOR_PICTURE,
            visualFramePosition=(0, 0, -FLOOR_PICTURE[2]),
            physicsClientId=world,
        )
        self._add_rigid(slot, floor, [[0.0, 0.0, 0.0]], FLOOR_OUTLINE, picture=slab)
        (x, y), thick, middle = RESERVOIR, WALL_HALF_THICKNESS, 0.5 * WALL_HEIGHT
        for size, offset in (
            ((thick, y + 2.0 * thick, middle), (x + thick, 0.0)),
            ((x, thick, middle), (0.0, y + thick)),
        ):
            shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=size, physicsClientId=world)
            outline = Shape("box", COLOURS["scene"], ((0.0, 0.0, 0.0),), size, LEVEL)
            places = [[sign * offset[0], sign * offset[1], middle] for sign in (-1.0, 1.0)]
            self._add_rigid(slot, shape, places, outline)
        shape = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=BALL_RADIUS, physicsClientId=world)
        points, triangles = BALL_PICTURE
        picture = pybullet.createVisualShape(
            pybullet.GEOM_MESH, vertices=points, indices=triangles, normals=points, physicsClientId=world
        )
        return self._add_rigid(slot, shape, lay_balls(self.piles[slot]).tolist(), BALL_OUTLINE, BALL_MASS, picture)

    def _add_rigid(
        self,
        slot: int,
        shape: int,
        positions: list[list[float]],
        outline: Shape,
        mass: float = 0.0,
        picture: int = -1,
    ) -> list[int]:
        """Add rigid bodies of one shape; a world of rigid bodies steps twice as fast as one of multibodies."""
        world = self.worlds[slot]
        bodies: list[int] = list(
            pybullet.createMultiBody(
                mass, shape, picture, useMaximalCoordinates=1, batchPositions=positions, physicsClientId=world
            )
        )
        for body in bodies:
            pybullet.changeDynamics(
                body,
                -1,
                lateralFriction=FRICTION,
                restitution=0.0,
                linearDamping=LINEAR_DAMPING,
                angularDamping=ANGULAR_DAMPING,
                physicsClientId=world,
            )
            self.paint(slot, body, outline.colour)
            self.outlines[slot][body] = (outline,)
        return bodies

    def build(self, slots: Slots, designs: Floats) -> None:
        """Put the tools `designs` (b, D) on the floor and pour the balls that were there onto them."""
        self.designs[slots] = designs
        for slot, design in zip(slots.tolist(), designs, strict=True):
            balls, world = self.bodies[slot, :, PLACE], self.worlds[slot]
            inside = np.flatnonzero(touching(design, balls - TOOL_START))
            for ball, place in zip(inside.tolist(), pour(design, len(inside), self.piles[slot]).tolist(), strict=True):
                pybullet.resetBasePositionAndOrientation(self.moving[slot][ball], place, LEVEL, physicsClientId=world)
        start = np.zeros((len(slots), CONTROL.size))
        start[:, POSE_PLACE] = TOOL_START
        self.add_tools(slots, scoop_boxes(designs), start)
        self.drive(slots, np.zeros_like(start))
        for _ in range(self.settling_steps):
            self.advance(slots)
        self._observe(slots)
        self._observe(slots)  # twice: speed is the change since the last call, and settled balls are slow
        self.potential[slots] = 0.0

    def step(self, slots: Slots, controls: Floats) -> None:
        """Change the tools' poses by `controls` (b, C) and reward lifted balls."""
        self.drive(slots, self._displacements(slots, controls))
        self.advance(slots)
        above, held, clear, raised = self._observe(slots)
        self.clear_steps[slots] += clear
        right = held == self.wanted[slots]
        self.set_success(slots, HELD_STEPS, clear=clear, wanted_number=right, none_flying=above == held)
        self.failure[slots] = ~self.success[slots] & (self.clear_steps[slots] >= LOST_STEPS)
        potential = PROGRESS_REWARD * raised * closeness(above, self.wanted[slots])
        self.set_reward(
            slots,
            progress=potential - self.potential[slots],
            slack=SLACK_REWARD,
            success=SUCCESS_REWARD * self.success[slots],
        )
        self.potential[slots] = potential
        self.outcome[slots] = held
        self.state[slots, HELD_SHARE] = self.met_steps[slots] / HELD_STEPS
        self.state[slots, CLEAR_SHARE] = self.clear_steps[slots] / LOST_STEPS

    def inspect(self, slot: int) -> Physics:
        """Return deepest overlap, highest speed, and whether all balls are in the room; balls overlap by distance."""
        world, tool, balls = self.worlds[slot], self._tool(slot), self.bodies[slot, :, PLACE]
        apart = np.linalg.norm(balls[:, None] - balls, axis=2) + 2.0 * BALL_RADIUS * np.eye(BALLS)
        others = {pybullet.getBodyUniqueId(index, world) for index in range(pybullet.getNumBodies(world))}
        others |= set(self.moving[slot])
        contacts = (
            point
            for other in sorted(others - {tool})
            for point in pybullet.getClosestPoints(tool, other, 0.0, physicsClientId=world)
        )
        beyond = np.abs(balls[:, :2]) + BALL_RADIUS - RESERVOIR
        low_inside: Booleans = (beyond.max(axis=1) < BALL_RADIUS) & (balls[:, 2] < WALL_HEIGHT)
        low, high = np.array(self.room).T
        return Physics(
            overlap=max(
                2.0 * BALL_RADIUS - float(apart.min()),
                BALL_RADIUS - float(balls[:, 2].min()),
                float(beyond[low_inside].max(initial=0.0)),
                *(-point[8] for point in contacts),
                0.0,
            ),
            speed=float(np.linalg.norm(self.bodies[slot, :, VELOCITY], axis=1).max()),
            contained=bool(((balls >= low) & (balls <= high)).all()),
        )

    def mark(self, slot: int, marks: Marks) -> None:
        """Draw the line around the reservoir, with a dot for every requested ball, filled for every held ball."""
        x, y = RESERVOIR
        corners = np.array([(x, y), (-x, y), (-x, -y), (x, -y), (x, y)])
        marks.line(np.pad(corners, ((0, 0), (0, 1)), constant_values=LINE), COLOURS["goal"])
        count = max(int(self.wanted[slot]), int(self.outcome[slot]))
        for place, share in enumerate(np.linspace(-0.9, 0.9, 10)[:count]):
            dot = np.array([x * share, -y, LINE])
            marks.dot(dot, COLOURS["goal" if place < self.wanted[slot] else "scene"], radius=7)
            marks.dot(dot, COLOURS["object" if place < self.outcome[slot] else "background"], radius=4)

    def _displacements(self, slots: Slots, controls: Floats) -> Floats:
        """Return the changes of pose (b, 6) for `controls` (b, C), within the limits."""
        pose = self.pose[slots]
        target = pose + controls * CONTROL.bounds[1]
        for axis in (0, 1):
            target[:, axis] = np.clip(target[:, axis], TOOL_START[axis] - REACH[axis], TOOL_START[axis] + REACH[axis])
        target[:, POSE_TURN] = np.clip(target[:, POSE_TURN], -np.array(LARGEST_TURN), LARGEST_TURN)
        lowest = FLOOR_CLEARANCE + drop(self.designs[slots], turn_matrices(target[:, POSE_TURN]))
        target[:, 2] = np.clip(target[:, 2], lowest, HIGHEST)
        displacement: Floats = target - pose
        return displacement

    def _observe(self, slots: Slots) -> tuple[Floats, Floats, Booleans, Floats]:
        """Read the worlds; return balls above and held, whether tools are clear, and the lifted fraction, (b,) each."""
        pose, balls = self.read_tools(slots), self.read_bodies(slots)[:, :, PLACE]
        self._write_profile(slots, pose[:, :2])
        matrices = turn_matrices(pose[:, POSE_TURN])
        local = (balls - pose[:, None, POSE_PLACE]) @ matrices
        # Speed from the change of position in the tool's own frame: the motion of the tool, its rotation included,
        # drops out.
        slow = np.linalg.norm(local - self.local[slots], axis=2) < HELD_SPEED * self.clock.control_period
        self.local[slots] = local
        over = above_bottom(self.designs[slots], local)
        lowest = pose[:, 2] - drop(self.designs[slots], matrices)
        clear = lowest > LINE
        above = over.sum(axis=1)
        held = (over & slow).sum(axis=1) * clear
        way = LINE - lowest
        state = self.state
        state[slots, TOOL_PLACE], state[slots, TOOL_TURN] = pose[:, POSE_PLACE], pose[:, POSE_TURN]
        state[slots, WAY_TO_LINE] = way
        state[slots, BALLS_ABOVE] = above
        state[slots, BALLS_HELD] = held
        state[slots, BALLS_MISSING] = self.wanted[slots] - above
        some = np.maximum(above, 1)[:, None]
        state[slots, CENTRE] = (local[:, :, :2] * over[:, :, None]).sum(axis=1) / some
        state[slots, HIGHEST_BALL] = (local[:, :, 2] * over).max(axis=1)
        raised = np.clip(1.0 - way / (LINE - FLOOR_CLEARANCE), 0.0, 1.0)
        return above, held, clear, raised

    def _write_profile(self, slots: Slots, middles: Floats) -> None:
        balls = self.bodies[slots]
        surface, rise = profile(balls[..., PLACE], balls[..., VELOCITY.start + 2], middles)
        self.state[slots, SURFACE], self.state[slots, RISE] = surface, rise


def lay_balls(rng: np.random.Generator) -> Floats:
    """Return the positions (N, 3) of balls on the floor, each at a random position in a separate cell."""
    columns = int(RESERVOIR[0] / BALL_RADIUS)
    rows = -(-BALLS // columns)
    cell = np.array([2.0 * RESERVOIR[0] / columns, 2.0 * RESERVOIR[1] / rows])
    cells = rng.permutation(columns * rows)[:BALLS]
    middle = (np.stack([cells % columns, cells // columns], axis=1) + 0.5) * cell - RESERVOIR
    places = np.full((BALLS, 3), BALL_RADIUS)
    places[:, :2] = middle + rng.uniform(-0.95, 0.95, size=(BALLS, 2)) * (0.5 * cell - BALL_RADIUS)
    return places


def pour(design: Floats, count: int, rng: np.random.Generator) -> Floats:
    """Return positions (count, 3) above the tool `design` (D,) at its start, in layers, all clear of each other."""
    pitch = 2.0 * BALL_RADIUS + POUR_GAP
    layer, row, column = np.unravel_index(np.arange(count), (BALLS, POUR_COLUMNS, POUR_COLUMNS))
    angles, heights = design[ANGLES], design[HEIGHTS]
    # The first row is clear of the back plate, which is on the rear edge of the bottom plate and may lean inwards.
    inwards = max(0.0, -np.sin(angles[BACK]) * heights[BACK])
    back = -0.5 * design[BOTTOM_LENGTH] + inwards + BALL_RADIUS + 0.5 * POUR_GAP
    first = max(back, -pitch)
    jitter = rng.uniform(-0.45, 0.45, size=(count, 2)) * POUR_GAP
    shift = rng.uniform((-0.02, 0.0), (0.02, 0.015))
    top = (heights * np.cos(angles)).max() - HALF_THICKNESS
    x = (column - 0.5 * (POUR_COLUMNS - 1)) * pitch + jitter[:, 0] + shift[0]
    y = first + row * pitch + jitter[:, 1] + shift[1]
    # The lowest layer is above the tool's rim and above the balls on the floor around it.
    lowest = max(top + BALL_RADIUS + 2.0 * HALF_THICKNESS, BALL_RADIUS + pitch - TOOL_START[2])
    z = lowest + layer * pitch
    return TOOL_START + np.stack([x, y, z], axis=1)


def scoop_boxes(designs: Floats) -> Boxes:
    """Return the boxes of tools (b, D) in the tool's frame: handle, back, bottom, front, left and right plates."""
    count = len(designs)
    half, heights, angles = 0.5 * designs[:, BOTTOM], 0.5 * designs[:, HEIGHTS], designs[:, ANGLES]
    sizes = np.zeros((count, 6, 3))
    centres, rotations = np.zeros((count, 6, 3)), np.zeros((count, 6, 4))
    rotations[:, 2, 3] = 1.0
    sizes[:, 2] = np.stack([*half.T, np.full(count, HALF_THICKNESS)], axis=1)
    for side, node in enumerate(SIDE_NODES):
        axis = int(np.argmax(np.abs(OUTWARDS[side])))
        height, angle = heights[:, side], angles[:, side]
        # The plate's inner face starts at the bottom plate's edge, level with its underside, and rotates outwards about
        # this line.
        out = half[:, axis] + HALF_THICKNESS * np.cos(angle) + height * np.sin(angle)
        centres[:, node, axis] = OUTWARDS[side, axis] * out
        centres[:, node, 2] = height * np.cos(angle) - HALF_THICKNESS * (1.0 + np.sin(angle))
        sizes[:, node, axis] = HALF_THICKNESS
        sizes[:, node, 1 - axis] = half[:, 1 - axis]
        sizes[:, node, 2] = height
        sign = OUTWARDS[side, axis] * (1.0 if axis == 0 else -1.0)
        rotations[:, node] = rotations_about(1 - axis, sign * angle)
    # The handle starts at the top of the back plate and leans further back.
    angle, height = angles[:, BACK], heights[:, BACK]
    lean = angle + HANDLE_LEAN
    sizes[:, 0] = HANDLE_HALF_EXTENTS
    out = half[:, 1] + HALF_THICKNESS * np.cos(angle) + 2.0 * height * np.sin(angle)
    up = 2.0 * height * np.cos(angle) - HALF_THICKNESS * (1.0 + np.sin(angle))
    centres[:, 0, 1] = -out - HANDLE_HALF_EXTENTS[2] * np.sin(lean)
    centres[:, 0, 2] = up + HANDLE_HALF_EXTENTS[2] * np.cos(lean)
    rotations[:, 0] = rotations_about(0, lean)
    return Boxes(sizes, centres, rotations)


def beyond_sides(designs: Floats, points: Floats) -> Floats:
    """Return the signed distances (b, n, P) of `points` (b, n, 3), in the tools' frames, beyond each inner face."""
    half = 0.5 * designs[:, [BOTTOM_LENGTH, BOTTOM_LENGTH, BOTTOM_WIDTH, BOTTOM_WIDTH]][:, None]
    angles = designs[:, None, ANGLES]
    out = points[..., :2] @ OUTWARDS.T - half
    # Component along the plate's normal: a face that leans outwards by `angle` is further out, the higher the point.
    result: Floats = out * np.cos(angles) - (points[..., 2:] + HALF_THICKNESS) * np.sin(angles)
    return result


def above_bottom(designs: Floats, points: Floats) -> Booleans:
    """Return which `points` (b, n, 3), in the frame of tools (b, D), are above the bottom and between the sides."""
    inside: Booleans = (beyond_sides(designs, points) < 2.0 * HALF_THICKNESS).all(axis=2) & (points[..., 2] > 0.0)
    return inside


def touching(design: Floats, balls: Floats) -> Booleans:
    """Return which `balls` (N, 3) would touch the tool `design` (D,) or be inside it."""
    beyond = beyond_sides(design[None], balls[None])[0]
    near: Booleans = (beyond < 2.0 * HALF_THICKNESS + BALL_RADIUS + POUR_GAP).all(axis=1)
    return near


def profile(places: Floats, velocities: Floats, middles: Floats) -> tuple[Floats, Floats]:
    """Return how high the topmost ball reaches around x and y `middles` (b, 2), (b, M), m, and how fast it rises, m/s.

    Balls are at `places` (b, N, 3) and rise by `velocities` (b, N). Where there is no ball, the floor, at rest.
    """
    along = (places[..., :2] - middles[:, None] - PROFILE_START) / PROFILE_STEP
    # A ball lies over some of the four places around its middle.
    near = np.floor(along)[:, :, None] + [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)]
    square = BALL_RADIUS**2 - ((PROFILE_STEP * (near - along[:, :, None])) ** 2).sum(axis=-1)
    over = (square > 0.0) & ((near >= 0.0) & (near < PROFILE_POINTS)).all(axis=-1)
    slot, ball, _ = np.nonzero(over)
    height = places[slot, ball, 2] + np.sqrt(square[over])
    place = (PROFILE_POINTS * near[over][:, 0] + near[over][:, 1]).astype(np.intp)
    surface = np.zeros((len(places), PROFILE_POINTS**2))
    rise = np.zeros_like(surface)
    np.maximum.at(surface, (slot, place), height)
    topmost = height == surface[slot, place]
    rise[slot[topmost], place[topmost]] = velocities[slot, ball][topmost]
    return surface, rise


def turn_matrices(turns: Floats) -> Floats:
    """Return the rotation matrices (b, 3, 3) of `turns` (b, 3) about x, then y, then z, each about the rotated axis.

    This is the order of the gantry's turning joints.
    """
    about_x, about_y, about_z = (rotation_matrices(rotations_about(axis, turns[:, axis])) for axis in range(3))
    result: Floats = about_x @ about_y @ about_z
    return result


def drop(designs: Floats, matrices: Floats) -> Floats:
    """Return the height (b,) of the bottom plates' centres above their lowest points, m."""
    # Support of a box along z: for the lowest corner, every half extent counts with the absolute vertical component of
    # its axis.
    half = np.column_stack([0.5 * designs[:, BOTTOM], np.full(len(designs), HALF_THICKNESS)])
    result: Floats = (np.abs(matrices[:, 2]) * half).sum(axis=1)
    return result


def closeness(count: Floats, wanted: Slots) -> Floats:
    """Return 1 for the requested number, and less the further the ratio of both numbers is from 1."""
    few, many = np.minimum(count, wanted) + 1.0, np.maximum(count, wanted) + 1.0
    result: Floats = (few / many) ** CLOSENESS_POWER
    return result


def _area(designs: Floats) -> Floats:
    width, length = designs[:, BOTTOM].T
    back, front, left, right = designs[:, HEIGHTS].T
    result: Floats = width * length + width * (back + front) + length * (left + right)
    return result
