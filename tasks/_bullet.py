"""Shared by the 3D tasks: a simulator with one PyBullet world per slot, and a tool of boxes moved by a carrier.

Shapes: `B` slots, `b` the slots of a call, `N` moving bodies, `K` boxes of a tool, `A` axes of the held point.
Lengths are in m, angles in rad, times in s, masses in kg, forces in N. Rotations are quaternions (x, y, z, w).
"""

from __future__ import annotations

import weakref
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Annotated, ClassVar, TypeAlias

import numpy as np

from codesign_bench.task import (
    OURS,
    BoxPart,
    Floats,
    Frame,
    Given,
    Item,
    Numbers,
    Physics,
    Shape,
    Sketch,
    Slots,
    Viewpoint,
    constants,
)
from codesign_bench.task.robot import ArmReport, DeployedSimulator

from ._carriers import CARRIER_SCENE, LEVEL, Carrier, Gantry, HeldTool, ToolShape, pybullet, run
from ._marks import PICTURE_SHAPE, Camera, MarkList, Marks, PictureMarks
from ._scene import COLOURS, Clock
from ._zero_pages import zeros_given_back

GRAVITY: Annotated[float, Given("m/s^2", "the Earth's")] = 9.81
"""Gravitational acceleration of the scene."""
PUSH_FORCE: Annotated[float, Given("N", OURS)] = 50.0
"""Largest force of a sliding joint of the gantry."""
TURN_TORQUE = 10.0
"""Largest torque of a turning joint of the gantry, N m (ours)."""
TOOL_MASS: Annotated[float, Given("kg", OURS)] = 0.5
"""Mass of the tool."""
TOOL_FRICTION: Annotated[float, Given("1", OURS)] = 1.0
"""Friction of the tool's surface; PyBullet multiplies the friction coefficients of the two bodies in contact."""
SOLVER_ITERATIONS: Annotated[int, Given("1", "PyBullet's own")] = 50
"""Iterations of the contact solver in every physics step."""
BULLET_SCENE = {**CARRIER_SCENE, **constants(__name__)}
"""Constants of the tasks in PyBullet; a task may override them by name."""
MAX_SLOTS = 28
"""For `Task.max_slots`: an idle world takes 9 MB, or 28 MB where zeros cannot be given back (ours)."""
Triple: TypeAlias = tuple[float, float, float]
"""Along x, y and z, or of width, length and height."""
PLACE, ROTATION, VELOCITY, SPIN = slice(0, 3), slice(3, 7), slice(7, 10), slice(10, 13)
"""Columns of `BulletSimulator.bodies`: position (m), quaternion, velocity (m/s), angular velocity (rad/s)."""

_idle_worlds: list[int] = []
"""Connections of deleted simulators, reused by the next one: a new connection costs tens of ms and 9 MB."""


@dataclass(frozen=True)
class Boxes:
    """The boxes of `b` tools, in the frame of the held point."""

    half_extents: Floats
    """(b, K, 3)."""
    centres: Floats
    """(b, K, 3)."""
    rotations: Floats
    """(b, K, 4)."""


def box_parts(boxes: Boxes) -> tuple[BoxPart, ...]:
    """Return the parts of the first tool in `boxes`."""
    entries = zip(boxes.half_extents[0].tolist(), boxes.centres[0].tolist(), boxes.rotations[0].tolist(), strict=True)
    return tuple(BoxPart(tuple(half), tuple(centre), tuple(rotation)) for half, centre, rotation in entries)


def rotations_about(axis: int, angles: Floats) -> Floats:
    """Return (..., 4) rotations about the x, y or z axis (0, 1, 2) by `angles` (...)."""
    result = np.zeros((*np.shape(angles), 4))
    result[..., axis] = np.sin(0.5 * angles)
    result[..., 3] = np.cos(0.5 * angles)
    return result


def rotation_matrices(rotations: Floats) -> Floats:
    """Return the (..., 3, 3) matrices of unit `rotations` (..., 4)."""
    x, y, z, w = np.moveaxis(rotations, -1, 0)
    rows = (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


class BulletSimulator(DeployedSimulator):
    """One PyBullet world per slot, emptied before every episode so that no state carries over to the next.

    The robot is a `Gantry` unless another carrier is given, as in deployment.

    A subclass fills a world in `build_scene`, calls `restart` from `begin`, `add_tools` from `build`, and
    `drive`, `advance`, `read_tools` and `read_bodies` from `step`. Worlds are acquired on first use and reused after
    the simulator is deleted. `restart` resets everything that a subclass has set in a world; parameters of the engine
    are set only here.
    """

    camera: Camera
    room: ClassVar[tuple[tuple[float, float], ...]]
    """Lowest and highest x, y and z of the centres of moving bodies, m."""
    turning_axes: ClassVar[tuple[int, ...]] = ()
    """Axes that the tool turns about, after the three sliding joints; 0, 1, 2 for x, y, z."""
    push_force: ClassVar[float] = PUSH_FORCE
    turn_torque: ClassVar[float] = TURN_TORQUE
    tool_mass: ClassVar[float] = TOOL_MASS
    tool_friction: ClassVar[float] = TOOL_FRICTION
    solver_iterations: ClassVar[int] = SOLVER_ITERATIONS
    contact_correction: ClassVar[float | None] = None
    """Fraction of an overlap that a physics step removes; None: PyBullet's default."""

    def __init__(
        self, num_slots: int, state_size: int, num_bodies: int, clock: Clock, carrier: Carrier | None = None
    ) -> None:
        super().__init__(num_slots, state_size)
        self.clock = clock
        self.worlds: list[int | None] = [None] * num_slots
        self.moving: list[list[int]] = [[] for _ in range(num_slots)]
        """The moving bodies of every world except the tool, as `build_scene` returned them."""
        self.held: list[HeldTool | None] = [None] * num_slots
        self.tools: list[int | None] = [None] * num_slots
        """The bodies that hold the tools and include them as links."""
        self.outlines: list[dict[int, tuple[Shape, ...]]] = [{} for _ in range(num_slots)]
        """Shapes of every world's visible bodies except the tool, for `sketch`; PyBullet does not return them all."""
        self.bodies: Floats = np.zeros((num_slots, num_bodies, SPIN.stop))
        """(B, N, 13): `PLACE`, `ROTATION`, `VELOCITY` and `SPIN` of the moving bodies."""
        self.pose: Floats = np.zeros((num_slots, 3 + len(self.turning_axes)))
        """(B, A): pose of the held point."""
        self.carrier: Carrier = carrier or Gantry(self.turning_axes, self.push_force, self.turn_torque)
        """Holds the tools of all slots."""
        weakref.finalize(self, _hand_on, self.worlds)

    @abstractmethod
    def build_scene(self, slot: int) -> list[int]:
        """Add everything except the tool to the empty world of `slot`; return the moving bodies."""

    def restart(self, slots: Slots) -> None:
        """Empty the worlds of `slots` and build their scenes."""
        for slot in slots.tolist():
            world = self.worlds[slot]
            if world is None:
                world = self.worlds[slot] = _idle_worlds.pop() if _idle_worlds else _new_world()
            pybullet.resetSimulation(physicsClientId=world)
            # Contact pairs are sorted: the solver's result depends on their order, which would otherwise depend on what
            # was played in this world before.
            pybullet.setPhysicsEngineParameter(
                fixedTimeStep=self.clock.period,
                numSolverIterations=self.solver_iterations,
                deterministicOverlappingPairs=1,
                physicsClientId=world,
            )
            if self.contact_correction is not None:
                pybullet.setPhysicsEngineParameter(contactERP=self.contact_correction, physicsClientId=world)
            pybullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=world)
            self.held[slot] = self.tools[slot] = None
            self.outlines[slot] = {}
            self.moving[slot] = self.build_scene(slot)
        self.read_bodies(slots)

    def add_box(
        self,
        slot: int,
        half_extents: Sequence[float],
        position: Sequence[float],
        *,
        mass: float = 0.0,
        rotation: Sequence[float] = LEVEL,
        friction: float = 1.0,
        colour: str = COLOURS["scene"],
    ) -> int:
        """Add a box, fixed if it has no mass, to the world of `slot`; return its body."""
        world = self.worlds[slot]
        shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half_extents, physicsClientId=world)
        # Damping is PyBullet's default, not physics: it would slow falling and sliding bodies besides friction.
        body: int = pybullet.createMultiBody(mass, shape, -1, position, rotation, physicsClientId=world)
        pybullet.changeDynamics(
            body, -1, lateralFriction=friction, linearDamping=0.0, angularDamping=0.0, physicsClientId=world
        )
        self.paint(slot, body, colour)
        self.outlines[slot][body] = (Shape("box", colour, ((0.0, 0.0, 0.0),), tuple(half_extents), LEVEL),)
        return body

    def add_compound(
        self,
        slot: int,
        half_extents: Sequence[Sequence[float]],
        centres: Sequence[Sequence[float]],
        position: Sequence[float],
        *,
        mass: float,
        inertia: Sequence[float],
        friction: float = 1.0,
        colour: str = COLOURS["object"],
    ) -> int:
        """Add a loose body of axis-aligned boxes to the world of `slot`; return it.

        Args:
            slot: the slot of the world.
            half_extents: half extents of the boxes, (K, 3).
            centres: centres of the boxes relative to the centre of mass, (K, 3).
            position: position of the centre of mass.
            mass: total mass.
            inertia: moments of inertia about x, y and z, the principal axes, kg m^2.
            friction: friction of all boxes.
            colour: colour of all boxes, "#rrggbb".
        """
        world = self.worlds[slot]
        shape = pybullet.createCollisionShapeArray(
            shapeTypes=[pybullet.GEOM_BOX] * len(half_extents),
            halfExtents=half_extents,
            collisionFramePositions=centres,
            physicsClientId=world,
        )
        # A body without joints is simulated faster as a plain rigid body than as a multibody with one link.
        body: int = pybullet.createMultiBody(
            mass, shape, -1, position, useMaximalCoordinates=True, physicsClientId=world
        )
        pybullet.changeDynamics(
            body,
            -1,
            mass=mass,  # without it, setting the inertia sets the mass to 0
            localInertiaDiagonal=inertia,
            lateralFriction=friction,
            linearDamping=0.0,
            angularDamping=0.0,
            physicsClientId=world,
        )
        self.paint(slot, body, colour)
        self.outlines[slot][body] = tuple(
            Shape("box", colour, (tuple(centre),), tuple(half), LEVEL)
            for half, centre in zip(half_extents, centres, strict=True)
        )
        return body

    def paint(self, slot: int, body: int, colour: str, link: int = -1) -> None:
        """Set the colour ("#rrggbb") of a body or of one of its links in pictures."""
        pybullet.changeVisualShape(body, link, rgbaColor=_rgba(colour), physicsClientId=self.worlds[slot])

    def hide(self, slot: int, body: int) -> None:
        """Make a body of one shape invisible in pictures."""
        pybullet.changeVisualShape(body, -1, rgbaColor=(1.0, 1.0, 1.0, 0.0), physicsClientId=self.worlds[slot])
        self.outlines[slot].pop(body, None)

    def add_tools(self, slots: Slots, boxes: Boxes, poses: Floats) -> None:
        """Add a carrier with a tool of `boxes` to the worlds of `slots`, held at `poses` (b, A)."""
        parts = boxes.half_extents.tolist(), boxes.centres.tolist(), boxes.rotations.tolist()
        for slot, half_extents, centres, rotations, pose in zip(slots.tolist(), *parts, poses.tolist(), strict=True):
            tool = ToolShape(half_extents, centres, rotations, self.tool_mass, self.tool_friction)
            held = self.carrier.add(self.worlds[slot], tool, pose)
            self.held[slot], self.tools[slot] = held, held.body
            self.paint(slot, held.body, COLOURS["tool"], held.tool_link)
        self.pose[slots] = poses

    def drive(self, slots: Slots, displacements: Floats) -> None:
        """Set the motors of `slots` to move the held points by `displacements` (b, A) in one control step."""
        velocities = (displacements / self.clock.control_period).tolist()
        for slot, velocity in zip(slots.tolist(), velocities, strict=True):
            self._held(slot).drive(velocity)

    def advance(self, slots: Slots) -> None:
        """Take the physics steps of one control step in the worlds of `slots`."""
        steps = self.clock.steps
        for slot in slots.tolist():
            held, world = self.held[slot], self.worlds[slot]
            if held is None:
                run(world, steps)
            else:
                held.advance(steps)

    def read_tools(self, slots: Slots) -> Floats:
        """Read the poses of the held points of `slots` into `pose` and return them, (b, A)."""
        self.pose[slots] = [self._held(slot).read() for slot in slots.tolist()]
        return self.pose[slots]

    def read_bodies(self, slots: Slots) -> Floats:
        """Read positions and velocities of the moving bodies of `slots` into `bodies` and return them, (b, N, 13)."""
        place, motion = pybullet.getBasePositionAndOrientation, pybullet.getBaseVelocity
        values: list[float] = []
        for slot in slots.tolist():
            world = self.worlds[slot]
            for body in self.moving[slot]:
                for part in (*place(body, world), *motion(body, world)):
                    values.extend(part)
        self.bodies[slots] = np.array(values).reshape(len(slots), -1, SPIN.stop)
        return self.bodies[slots]

    def perturb(self, slot: int, friction: float, mass: float) -> None:
        """Multiply friction and mass (with the inertia) of the moving bodies in `slot`."""
        world = self.worlds[slot]
        for body in self.moving[slot]:
            own_mass, own_friction, inertia, *_ = pybullet.getDynamicsInfo(body, -1, physicsClientId=world)
            pybullet.changeDynamics(
                body,
                -1,
                mass=mass * own_mass,
                localInertiaDiagonal=[mass * value for value in inertia],
                lateralFriction=friction * own_friction,
                physicsClientId=world,
            )

    def arm_report(self, slot: int) -> ArmReport:
        """Return the report on the arm in `slot` since `build`; that of the gantry is always empty."""
        return self._held(slot).report

    def inspect(self, slot: int) -> Physics:
        """Return deepest overlap of any two bodies, fastest body, and whether all moving bodies are in the room."""
        world = self.worlds[slot]
        loose = {*self.moving[slot], self._tool(slot)}
        listed = {pybullet.getBodyUniqueId(index, world) for index in range(pybullet.getNumBodies(world))}
        bodies = sorted(listed | loose)  # of bodies created in one call, PyBullet lists only the last
        points = (
            point
            for first, second in combinations(bodies, 2)
            if first in loose or second in loose
            for point in pybullet.getClosestPoints(first, second, 0.0, physicsClientId=world)
        )
        states = self.bodies[slot]
        low, high = np.array(self.room).T
        return Physics(
            overlap=max((-point[8] for point in points), default=0.0),
            speed=float(np.linalg.norm(states[:, VELOCITY], axis=1).max(initial=0.0)),
            contained=bool(((states[:, PLACE] >= low) & (states[:, PLACE] <= high)).all()),
        )

    def tool_shapes(self, slot: int) -> tuple[BoxPart, ...]:
        """Return the boxes of the tool's link, with a gripper's handle if there is one."""
        held, world = self._held(slot), self.worlds[slot]
        # PyBullet gives the shapes' positions relative to the centre of mass, and that relative to the link's frame.
        centre = np.array(pybullet.getDynamicsInfo(held.body, held.tool_link, physicsClientId=world)[3])
        shapes = pybullet.getCollisionShapeData(held.body, held.tool_link, physicsClientId=world)
        return tuple(
            BoxPart(tuple(0.5 * side for side in shape[3]), tuple((centre + shape[5]).tolist()), shape[6])
            for shape in shapes
        )

    def render(self, slot: int) -> Frame:
        """Return a picture from PyBullet's software renderer, with the marks that the task adds in `mark`."""
        camera, (height, width) = self.camera, PICTURE_SHAPE
        view = pybullet.computeViewMatrix(camera.eye, camera.target, camera.up)
        projection = pybullet.computeProjectionMatrixFOV(camera.field_of_view, width / height, camera.near, camera.far)
        picture = pybullet.getCameraImage(
            width,
            height,
            view,
            projection,
            shadow=0,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self.worlds[slot],
        )
        pixels = np.asarray(picture[2], dtype=np.uint8).reshape(height, width, 4)[..., :3]
        marks = PictureMarks(pixels, np.reshape(view, (4, 4)) @ np.reshape(projection, (4, 4)))
        self.mark(slot, marks)
        return marks.frame()

    def sketch(self, slot: int) -> Sketch:
        """Return the bodies and marks of `render` as data; of an arm, only the tool."""
        camera, (height, width), marks = self.camera, PICTURE_SHAPE, MarkList()
        self.mark(slot, marks)
        view = Viewpoint(camera.eye, camera.target, camera.up, camera.field_of_view, camera.near, aspect=width / height)
        bodies = tuple(self._item(slot, body) for body in self.outlines[slot])
        return Sketch(view, (*bodies, *marks.items), self._tool_pose(slot), COLOURS["tool"])

    def _item(self, slot: int, body: int) -> Item:
        """Return a body as data."""
        shapes = self.outlines[slot][body]
        place, rotation = pybullet.getBasePositionAndOrientation(body, self.worlds[slot])
        return Item(shapes, tuple(place) if shapes[0].kind == "ball" else (*place, *rotation))

    def _tool_pose(self, slot: int) -> Numbers:
        """Return position and rotation of the held point; empty before there is a tool."""
        held, world = self.held[slot], self.worlds[slot]
        if held is None:
            return ()
        state = pybullet.getLinkState(held.body, held.tool_link, computeForwardKinematics=1, physicsClientId=world)
        return (*state[4], *state[5])

    def mark(self, slot: int, marks: Marks) -> None:
        """Draw marks that are not bodies, e.g. a goal or a line, on top of the bodies. Nothing by default."""

    def _held(self, slot: int) -> HeldTool:
        held = self.held[slot]
        assert held is not None, "a tool is built before it is moved"
        return held

    def _tool(self, slot: int) -> int:
        tool = self.tools[slot]
        assert tool is not None, "a tool is built before it is moved"
        return tool


def _new_world() -> int:
    """Return a new connection, without the zeros that are two thirds of its memory."""
    with zeros_given_back():
        world: int = pybullet.connect(pybullet.DIRECT)
    return world


def _hand_on(worlds: list[int | None]) -> None:
    """Keep the connections of a deleted simulator for the next one."""
    _idle_worlds.extend(world for world in worlds if world is not None)


def _rgba(colour: str) -> tuple[float, float, float, float]:
    red, green, blue = (int(colour[start : start + 2], 16) / 255.0 for start in (1, 3, 5))
    return red, green, blue, 1.0
