"""Scoop 3D: a scoop is lifted out of a reservoir with as many balls as are wanted. Docstring of `Scoop3D` has more.

Shapes: `b` slots a call names, `I` = 2 instance (balls wanted, pile), `D` = 10 design, `C` = 6 control, `N` = 40 balls,
`P` = 4 side plates (back, front, left, right), `K` = 6 boxes of a tool, `M` = 49 places of the profile of a pile.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
import pybullet

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
    ToolGraph,
    ToolPart,
    constants,
)

from ._bullet import (
    BULLET_SCENE,
    LEVEL,
    MAX_SLOTS,
    PLACE,
    VELOCITY,
    Boxes,
    BulletSimulator,
    Camera,
    Marks,
    Triple,
    box_parts,
    rotation_matrices,
    rotations_about,
)
from ._scene import COLOURS, Clock

PAPER = "paper, table of 3D scoop"
TEXT = 'paper, appendix "Environment Details"'

BALLS: Annotated[int, Given("balls", TEXT)] = 40
"""In the reservoir."""
WANTED: Annotated[tuple[int, int], Given("balls", TEXT)] = (1, 7)
"""Fewest and most balls that are wanted."""

BOX_MIN: Annotated[Triple, Given("m", PAPER, "box_dimensions_min")] = (0.04, 0.005, 0.02)
"""Smallest width, thickness and height of a plate, read as half extents, as PyBullet does (our reading)."""
BOX_MAX: Annotated[Triple, Given("m", PAPER, "box_dimensions_max")] = (0.08, 0.005, 0.05)
"""Largest width, thickness and height of a plate, read as half extents (our reading)."""
HALF_THICKNESS = BOX_MIN[1]
"""Of a plate, m: the paper's smallest and largest are the same."""
ANGLE_MIN: Annotated[float, Given("degrees", PAPER, "tool_angle_min")] = -15.0
"""How far a side plate leans outwards at least."""
ANGLE_MAX: Annotated[float, Given("degrees", PAPER, "tool_angle_max")] = 15.0
"""How far a side plate leans outwards at most."""
HANDLE_HALF_EXTENTS: Annotated[Triple, Given("m", OURS)] = (0.01, HALF_THICKNESS, 0.1)
"""Of the handle."""
HANDLE_LEAN: Annotated[float, Given("rad", OURS)] = np.deg2rad(30.0)
"""The handle leans outwards by this from the back plate: it never passes over the opening."""
TOOL_MASS: Annotated[float, Given("kg", OURS)] = 0.2
"""Of the tool."""
PUSH_FORCE: Annotated[float, Given("N", OURS)] = 20.0
"""Largest force of a sliding joint of the gantry."""
TURN_TORQUE: Annotated[float, Given("N m", OURS)] = 2.0
"""Largest torque of a turning joint of the gantry."""

BALL_RADIUS: Annotated[float, Given("m", OURS)] = 0.029
"""Of a ball: tools hold 1 ball to 15."""
BALL_MASS: Annotated[float, Given("kg", OURS)] = 0.05
"""Of a ball."""
FRICTION: Annotated[float, Given("1", OURS)] = 0.3
"""Of balls, plates, walls and floor; PyBullet multiplies the frictions of a contact's two bodies, so a contact's is
0.09: slippery balls do not pile up beyond the rim."""
TOOL_FRICTION: Annotated[float, Given("1", OURS)] = FRICTION
"""Of the tool's surface."""
LINEAR_DAMPING: Annotated[float, Given("1/s", OURS)] = 0.1
"""Share of its speed that a ball loses in a second."""
ANGULAR_DAMPING: Annotated[float, Given("1/s", OURS)] = 0.5
"""Share of its spin that a ball loses in a second."""
RESERVOIR: Annotated[tuple[float, float], Given("m", OURS)] = (0.22, 0.255)
"""Half the inner size of the reservoir along x and y: a ball passes between any tool and a wall."""
WALL_HEIGHT: Annotated[float, Given("m", OURS)] = 0.1
"""Of the reservoir's walls."""
WALL_HALF_THICKNESS: Annotated[float, Given("m", OURS)] = 0.01
"""Of the reservoir's walls."""
FLOOR_PICTURE = (1.0, 1.0, 0.01)
"""Half extents of what is drawn of the endless floor, m (ours)."""
FLOOR_COLOUR = "#e4e6ea"
"""What the floor is drawn in (ours)."""
LINE: Annotated[float, Given("m", OURS)] = 0.13
"""A tool that is nowhere lower than this is clear of the reservoir."""

FLOOR_CLEARANCE: Annotated[float, Given("m", OURS)] = 0.004
"""Between floor and bottom plate at the start, and least ever."""
TOOL_START: Annotated[Triple, Given("m", f"{PAPER}; z ours", "tool_position_init")] = (
    0.0,
    0.05,
    FLOOR_CLEARANCE + HALF_THICKNESS,
)
"""Where the middle of the bottom plate starts: the paper's z is above the balls, ours is among them."""
REACH: Annotated[tuple[float, float], Given("m", OURS)] = (0.03, 0.03)
"""The tool moves no further than this from its start along x and y."""
HIGHEST: Annotated[float, Given("m", OURS)] = 0.2
"""Highest place of the middle of the bottom plate."""
LARGEST_TURN: Annotated[Triple, Given("rad", OURS)] = (0.25, 0.25, 0.3)
"""Largest turns about x, y and z: the tool cannot be tipped out, so that its shape decides the count."""
CONTROL_MIN: Annotated[tuple[float, ...], Given("1", PAPER, "control_action_min")] = (-1.0,) * 3 + (-1.57,) * 3
"""Lower bounds of a control along and about x, y and z, before scaling."""
CONTROL_MAX: Annotated[tuple[float, ...], Given("1", PAPER, "control_action_max")] = (1.0,) * 3 + (1.57,) * 3
"""Upper bounds of a control, before scaling."""
CONTROL_SCALE: Annotated[float, Given("m, rad", OURS, "control_action_scale")] = 0.015
"""From these bounds to a change of pose in a control step: 0.45 m/s and 0.71 rad/s. The paper's scale would be 1.5 m/s
and 2.4 rad/s, at which balls are thrown about."""

PILES: Annotated[int, Given("piles", OURS)] = 2**20
"""Different piles."""
POUR_COLUMNS: Annotated[int, Given("balls", OURS)] = 3
"""Balls that lie where the tool will are poured on it in layers of this many by this many."""
POUR_GAP: Annotated[float, Given("m", OURS)] = 0.004
"""Between balls before they are poured."""
SETTLING_STEPS: Annotated[int, Given("control steps", OURS)] = 16
"""For which poured balls come to rest before the first control."""

HELD_SPEED: Annotated[float, Given("m/s", OURS)] = 0.5
"""A held ball moves no faster than this in the frame of the tool."""
HELD_STEPS: Annotated[int, Given("control steps", OURS)] = 6
"""How long in a row the wanted number must be held."""
LOST_STEPS: Annotated[int, Given("control steps", OURS)] = 30
"""For which a tool may be clear of the reservoir without success."""
PROGRESS_REWARD: Annotated[float, Given("1", OURS)] = 5.0
"""Scale of the potential."""
CLOSENESS_POWER: Annotated[float, Given("1", OURS)] = 1.5
"""How much a wrong count costs."""
SLACK_REWARD: Annotated[float, Given("1", PAPER, "slack_reward")] = -0.001
"""Added in every control step."""
SUCCESS_REWARD: Annotated[float, Given("1", PAPER, "success_reward")] = 10.0
"""Added once, when the wanted number is held."""

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
"""Share of an overlap that a physics step takes away."""

PROFILE_POINTS: Annotated[int, Given("1", OURS)] = 7
"""Along x and along y the policies see how high the balls lie at so many places."""
PROFILE_STEP: Annotated[float, Given("m", OURS)] = 0.04
"""Between neighbouring places: less than a ball is wide, more than its radius."""

SIDES = ("back", "front", "left", "right")
BACK = SIDES.index("back")
SIDE_NODES = (1, 3, 4, 5)
"""Their nodes in the tool graph."""
OUTWARDS = np.array([[0.0, -1.0], [0.0, 1.0], [-1.0, 0.0], [1.0, 0.0]])
"""(P, 2) where the side plates stand, seen from the middle of the bottom plate."""


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
"""Along x and y."""
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
    """Return points and triangles of a coarse ball; PyBullet's own, a fine one, takes 0.3 ms a ball to make."""
    tilt, turn = np.meshgrid(np.linspace(0.0, np.pi, rings), np.linspace(0.0, 2.0 * np.pi, columns), indexing="ij")
    points = np.stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)], axis=-1)
    corner = (np.arange(rings - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    upper = np.stack([corner, corner + columns, corner + 1], axis=1)
    lower = np.stack([corner + 1, corner + columns, corner + columns + 1], axis=1)
    return (BALL_RADIUS * points.reshape(-1, 3)).tolist(), np.concatenate([upper, lower]).ravel().tolist()


BALL_PICTURE = _ball_picture()
"""Points (m) and triangles of what is drawn for a ball."""


class Scoop3D(Task):
    """Scoop as many balls out of a reservoir as are wanted (paper, appendix "Environment Details").

    The tool is a scoop of six links: a rectangular bottom plate, a plate on each of its four sides, and a handle on the
    back one. It starts on the floor of the reservoir, among the balls and filled to overflowing; what does not fit
    rolls off on the way up. The tool can be turned only a little, so the room between its plates decides how many balls
    come along, and every number wants a tool of its own.

    Action space
        Design, 10: width and length of the bottom plate (m), heights of the back, front, left and right plates (m), and
        how far each of these leans outwards (rad) (paper). Control, 6: change of the tool's place x, y, z (m) and of
        its turns about x, y, z (rad) in a control step (paper; scale ours). Place and turns are limited (ours).

    Observation
        State, 120: place x, y, z (m) and turns about x, y, z (rad) of the bottom plate, way from its lowest point up to
        the line (m); balls in or above the tool, balls held above the line, balls that are missing; the shares of the
        control steps after which success and failure come; mean place of the balls in or above the tool, in its frame,
        x, y (m), and the highest of them (m); which number is wanted, one entry for each; and the balls, as a profile
        of the pile: how high the topmost ball reaches (m) at the places of a square grid that moves with the middle of
        the bottom plate, and how fast this ball rises (m/s). Goal, 1: the wanted number. Then the design and the phase.

        The paper's policies observe positions and velocities of the balls; the profile is our form of them. It does not
        depend on the balls' order, is shorter, and shows the designer the balls around the place of the tool, before
        there is one. Sorted positions and velocities, and those of the nearest balls, jump where two balls change
        places in the order.

    Design space
        Sizes are whole widths, lengths and heights: the paper's table is read as half extents, PyBullet's own measure
        (ours); its fixed entry is half the thickness of all plates. The bottom plate joins the four side plates, the
        back plate joins the handle, which the robot holds: it is fixed and leans back (ours), so that it never passes
        over the opening.

    Goal space
        Whole numbers of balls (paper), each equally often. An instance also holds the number of a pile: how the balls
        are placed and poured on the tool; it is no part of the goal, but the state shows how they lie.

    Reward
        The change of a potential that grows as the tool is lifted and is the larger, the nearer the number of balls in
        or above it is to the wanted one; less the paper's slack, and the paper's bonus on success. The potential starts
        at 0 whatever is in the tool. An episode's return is below 15.

    Starting state
        The middle of the bottom plate is where the paper's table has it, but close to the floor: at the paper's height
        it would be above the balls. The balls are on the floor side by side, each anywhere in its own cell. Those that
        would touch the tool are poured on it from above, then all come to rest before the first control (ours).

    Episode end
        Success when the tool is clear of the reservoir and exactly the wanted number of balls has been held for a few
        control steps; failure when it has been clear for longer without success; or the time limit. A ball is held if
        it is between the side plates, above the bottom plate, and slow in the tool's frame; while another one is still
        flying over the tool, nothing counts.
    """

    name = "scoop_3d"
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

    run_settings: ClassVar[ByProfile] = {"laptop": {"steps": 500_000, "evaluations": 10}}
    outcome = Quantity("balls held above the line", "balls")
    max_slots = MAX_SLOTS
    # Balls that meet at up to 2.8 m/s overlap for a step of 1/120 s, also right after they were poured; tools start
    # clear of all. A million random steps saw 0.56 and, right after pouring, 0.32 radii.
    soundness = Soundness(
        overlap=0.6 * BALL_RADIUS, speed=4.0, outcome_change=0.5, start_overlap=0.35 * BALL_RADIUS, chaotic=True
    )

    def sample_instances(self, rng: np.random.Generator, count: int) -> Floats:
        """Return (count, I) random whole numbers of balls and piles."""
        instances = np.zeros((count, INSTANCE.size))
        instances[:, BALLS_WANTED] = rng.integers(WANTED[0], WANTED[1], size=count, endpoint=True)
        instances[:, PILE] = rng.integers(0, PILES, size=count)
        return instances

    def material(self, designs: Floats) -> Floats:
        """Return the area of the plates over the largest one for designs (b, D) in their units."""
        largest = _area(np.array([self.design_space.high]))
        share: Floats = _area(designs) / largest
        return share

    def effort(self, controls: Floats) -> Floats:
        """Return the share of the largest change of pose for controls (b, C) in [-1, 1]."""
        change: Floats = np.linalg.norm(controls, axis=1) / np.sqrt(controls.shape[1])
        return change

    def tool_parts(self, design: Floats) -> tuple[ToolPart, ...]:
        """Return the handle and plates of the tool of a design (D,) in its units."""
        return box_parts(scoop_boxes(design[None]))

    def script(self) -> Behaviour:
        """Return a script that lifts straight up and holds still."""
        from ._scripts.scoop_3d import Scoop3DScript  # here, since that file reads this one

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
        """(B, N, 3) balls in the frame of the tool."""
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
        """Build floor and walls, and lay the balls on the floor side by side."""
        world = self.worlds[slot]
        floor = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=world)
        slab = pybullet.createVisualShape(
            pybullet.GEOM_BOX,
            halfExtents=FLOOR_PICTURE,
            visualFramePosition=(0, 0, -FLOOR_PICTURE[2]),
            physicsClientId=world,
        )
        self._add_rigid(slot, floor, [[0.0, 0.0, 0.0]], picture=slab, colour=FLOOR_COLOUR)
        (x, y), thick, middle = RESERVOIR, WALL_HALF_THICKNESS, 0.5 * WALL_HEIGHT
        for size, offset in (
            ((thick, y + 2.0 * thick, middle), (x + thick, 0.0)),
            ((x, thick, middle), (0.0, y + thick)),
        ):
            shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=size, physicsClientId=world)
            self._add_rigid(slot, shape, [[sign * offset[0], sign * offset[1], middle] for sign in (-1.0, 1.0)])
        shape = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=BALL_RADIUS, physicsClientId=world)
        points, triangles = BALL_PICTURE
        picture = pybullet.createVisualShape(
            pybullet.GEOM_MESH, vertices=points, indices=triangles, normals=points, physicsClientId=world
        )
        return self._add_rigid(slot, shape, lay_balls(self.piles[slot]).tolist(), BALL_MASS, picture, COLOURS["object"])

    def _add_rigid(
        self,
        slot: int,
        shape: int,
        positions: list[list[float]],
        mass: float = 0.0,
        picture: int = -1,
        colour: str = COLOURS["scene"],
    ) -> list[int]:
        """Add rigid bodies of one shape; a world of these steps in half the time that one of multi-bodies takes."""
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
            self.paint(slot, body, colour)
        return bodies

    def build(self, slots: Slots, designs: Floats) -> None:
        """Put the tools `designs` (b, D) on the floor and pour the balls that lay there on them."""
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
        self._observe(slots)  # Twice: balls that rest in the tool are slow.
        self.potential[slots] = 0.0

    def step(self, slots: Slots, controls: Floats) -> None:
        """Change the tools' poses by `controls` (b, C) and reward balls lifted."""
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
        """Return deepest overlap, fastest ball and whether all balls are in the room; balls by their distances."""
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
        """Draw the line around the reservoir, and a dot on it for every ball wanted, filled for every ball held."""
        x, y = RESERVOIR
        corners = np.array([(x, y), (-x, y), (-x, -y), (x, -y), (x, y)])
        marks.line(np.pad(corners, ((0, 0), (0, 1)), constant_values=LINE), COLOURS["goal"])
        count = max(int(self.wanted[slot]), int(self.outcome[slot]))
        for place, share in enumerate(np.linspace(-0.9, 0.9, 10)[:count]):
            dot = np.array([x * share, -y, LINE])
            marks.dot(dot, COLOURS["goal" if place < self.wanted[slot] else "scene"], radius=7)
            marks.dot(dot, COLOURS["object" if place < self.outcome[slot] else "background"], radius=4)

    def _displacements(self, slots: Slots, controls: Floats) -> Floats:
        """Return the (b, 6) changes of pose that `controls` (b, C) ask for, within the limits."""
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
        """Read the worlds; return balls above and held, whether the tools are clear, and the share of the way up."""
        pose, balls = self.read_tools(slots), self.read_bodies(slots)[:, :, PLACE]
        self._write_profile(slots, pose[:, :2])
        matrices = turn_matrices(pose[:, POSE_TURN])
        local = (balls - pose[:, None, POSE_PLACE]) @ matrices
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
    """Return the (N, 3) places of balls that lie on the floor side by side, each anywhere in a cell of its own."""
    columns = int(RESERVOIR[0] / BALL_RADIUS)
    rows = -(-BALLS // columns)
    cell = np.array([2.0 * RESERVOIR[0] / columns, 2.0 * RESERVOIR[1] / rows])
    cells = rng.permutation(columns * rows)[:BALLS]
    middle = (np.stack([cells % columns, cells // columns], axis=1) + 0.5) * cell - RESERVOIR
    places = np.full((BALLS, 3), BALL_RADIUS)
    places[:, :2] = middle + rng.uniform(-0.95, 0.95, size=(BALLS, 2)) * (0.5 * cell - BALL_RADIUS)
    return places


def pour(design: Floats, count: int, rng: np.random.Generator) -> Floats:
    """Return (count, 3) places above the tool `design` (D,) at its start, in layers, clear of it and of each other."""
    pitch = 2.0 * BALL_RADIUS + POUR_GAP
    layer, row, column = np.unravel_index(np.arange(count), (BALLS, POUR_COLUMNS, POUR_COLUMNS))
    angles, heights = design[ANGLES], design[HEIGHTS]
    # The first row clears the back plate, which stands on the plate's rear edge and may lean inwards, over the opening.
    inwards = max(0.0, -np.sin(angles[BACK]) * heights[BACK])
    back = -0.5 * design[BOTTOM_LENGTH] + inwards + BALL_RADIUS + 0.5 * POUR_GAP
    first = max(back, -pitch)
    jitter = rng.uniform(-0.45, 0.45, size=(count, 2)) * POUR_GAP
    shift = rng.uniform((-0.02, 0.0), (0.02, 0.015))
    top = (heights * np.cos(angles)).max() - HALF_THICKNESS
    x = (column - 0.5 * (POUR_COLUMNS - 1)) * pitch + jitter[:, 0] + shift[0]
    y = first + row * pitch + jitter[:, 1] + shift[1]
    # The lowest layer is above the tool's rim and above the balls that lie outside of it.
    lowest = max(top + BALL_RADIUS + 2.0 * HALF_THICKNESS, BALL_RADIUS + pitch - TOOL_START[2])
    z = lowest + layer * pitch
    return TOOL_START + np.stack([x, y, z], axis=1)


def scoop_boxes(designs: Floats) -> Boxes:
    """Return the boxes of tools (b, D) in their own frame: handle, back, bottom, front, left and right plates."""
    count = len(designs)
    half, heights, angles = 0.5 * designs[:, BOTTOM], 0.5 * designs[:, HEIGHTS], designs[:, ANGLES]
    sizes = np.zeros((count, 6, 3))
    centres, rotations = np.zeros((count, 6, 3)), np.zeros((count, 6, 4))
    rotations[:, 2, 3] = 1.0
    sizes[:, 2] = np.stack([*half.T, np.full(count, HALF_THICKNESS)], axis=1)
    for side, node in enumerate(SIDE_NODES):
        axis = int(np.argmax(np.abs(OUTWARDS[side])))
        height, angle = heights[:, side], angles[:, side]
        # The plate's inner face meets the bottom's edge, flush with its underside, and turns outwards about there.
        out = half[:, axis] + HALF_THICKNESS * np.cos(angle) + height * np.sin(angle)
        centres[:, node, axis] = OUTWARDS[side, axis] * out
        centres[:, node, 2] = height * np.cos(angle) - HALF_THICKNESS * (1.0 + np.sin(angle))
        sizes[:, node, axis] = HALF_THICKNESS
        sizes[:, node, 1 - axis] = half[:, 1 - axis]
        sizes[:, node, 2] = height
        sign = OUTWARDS[side, axis] * (1.0 if axis == 0 else -1.0)
        rotations[:, node] = rotations_about(1 - axis, sign * angle)
    # The handle goes on from the top of the back plate and leans further back.
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
    """Return how far `points` (b, n, 3), in the frame of tools (b, D), lie outside each inner face: (b, n, P)."""
    half = 0.5 * designs[:, [BOTTOM_LENGTH, BOTTOM_LENGTH, BOTTOM_WIDTH, BOTTOM_WIDTH]][:, None]
    angles = designs[:, None, ANGLES]
    out = points[..., :2] @ OUTWARDS.T - half
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
    """Return the (b, 3, 3) rotations of `turns` (b, 3) about x, then y, then z, each about the turned axis."""
    about_x, about_y, about_z = (rotation_matrices(rotations_about(axis, turns[:, axis])) for axis in range(3))
    result: Floats = about_x @ about_y @ about_z
    return result


def drop(designs: Floats, matrices: Floats) -> Floats:
    """Return how far the lowest point of the bottom plates lies below their middle, (b,), m."""
    half = np.column_stack([0.5 * designs[:, BOTTOM], np.full(len(designs), HALF_THICKNESS)])
    result: Floats = (np.abs(matrices[:, 2]) * half).sum(axis=1)
    return result


def closeness(count: Floats, wanted: Slots) -> Floats:
    """Return 1 for the wanted count and less the further the ratio of count and wanted is from 1."""
    few, many = np.minimum(count, wanted) + 1.0, np.maximum(count, wanted) + 1.0
    result: Floats = (few / many) ** CLOSENESS_POWER
    return result


def _area(designs: Floats) -> Floats:
    width, length = designs[:, BOTTOM].T
    back, front, left, right = designs[:, HEIGHTS].T
    result: Floats = width * length + width * (back + front) + length * (left + right)
    return result
