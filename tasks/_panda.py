"""The Franka Panda as a carrier of tools: PyBullet's model, inverse kinematics, and a joint controller with limits.

Shapes: `J` = 7 joints, `K` boxes of a tool, `A` = 3 axes of the held point (the tool is never turned).
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pybullet_data

from codesign_bench.task import BoxPart, Floats

from . import _panda_kinematics as kinematics
from ._carriers import LEVEL, Carrier, HeldTool, ToolShape, pybullet
from ._scene import Clock

MODEL = Path(pybullet_data.getDataPath()) / "franka_panda" / "panda.urdf"
GRIP_REACH = 0.105
"""Distance from the hand's frame to the middle of the finger tips along the hand's z axis, m (URDF)."""
FINGER_OPENING = 0.01
"""Distance of each finger from the middle, m (ours): closed around the post."""
BASE_TURN = 0.5 * np.pi
"""Turn of the base about z, rad (ours): the arm points along its x axis at rest, which is the y axis of the tasks."""

GRIP_BACK, GRIP_UP = 0.03, 0.09
"""The fingers hold a post this far behind and above the held point, m (ours).

So the hand, 6 cm thick, stays above the overhang and the table while the tool slides on the table.
"""
GRIP_LEAN = float(np.deg2rad(25.0))
"""The top of the hand leans away from the robot, rad (ours): an upright hand cannot get as near as 0.3 m."""
POST_HALF_WIDTH = 0.01
"""Half width of the post, m (ours)."""
FOOT_HALF_HEIGHT = 0.005
"""Half height of the bar between post and held point, m (ours): as thin as the thinnest tool."""
HANDLE = (
    BoxPart((FOOT_HALF_HEIGHT, 0.5 * GRIP_BACK, FOOT_HALF_HEIGHT), (0.0, -0.5 * GRIP_BACK, 0.0), LEVEL),
    BoxPart(
        (POST_HALF_WIDTH, POST_HALF_WIDTH, 0.5 * (GRIP_UP + POST_HALF_WIDTH + FOOT_HALF_HEIGHT)),
        (0.0, -GRIP_BACK, 0.5 * (GRIP_UP + POST_HALF_WIDTH - FOOT_HALF_HEIGHT)),
        LEVEL,
    ),
)
"""The bar behind the held point and, on it, the post that the fingers hold (ours)."""
TOOL_LINK = "tool"
FOREARM_LINK = 3
"""Links after this one belong to wrist and hand, which are rigid or too close together to collide with each other."""

STIFFNESS = 900.0
"""Joint acceleration per position error, 1/s^2 (ours): of the order of 3000 N/m at the hand."""
DAMPING = 2.0 * STIFFNESS**0.5
"""Joint acceleration per velocity error, 1/s (ours): critical damping."""
LEASH = 0.03
"""Largest distance between command and held point, m (ours), so that a blocked arm does not push ever harder."""
OVERLAP = 0.005
"""Links collide if they overlap deeper than this, m (ours); hulls of adjacent links overlap slightly at rest."""


def _grip_frame() -> Floats:
    """Return the hand's frame (4, 4) in the frame of the held point."""
    approach = np.array([0.0, -np.sin(GRIP_LEAN), -np.cos(GRIP_LEAN)])
    across = np.array([1.0, 0.0, 0.0])
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1], frame[:3, 2] = np.cross(across, approach), across, approach
    frame[:3, 3] = np.array([0.0, -GRIP_BACK, GRIP_UP]) - GRIP_REACH * approach
    return frame


GRIP = _grip_frame()


@dataclass(frozen=True)
class PandaArm(Carrier):
    """A Panda that holds tools by a post; see docs/deployment.md."""

    base: tuple[float, float, float]
    """Position of its base, m."""
    clock: Clock

    def add(self, world: int | None, tool: ToolShape, pose: Sequence[float]) -> HeldTool:
        """Add an arm with the tool's held point at `pose`, or as near to it as possible."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "panda_with_tool.urdf"
            path.write_text(model_with_tool(tool))
            body: int = pybullet.loadURDF(
                str(path),
                self.base,
                [0.0, 0.0, np.sin(0.5 * BASE_TURN), np.cos(0.5 * BASE_TURN)],
                useFixedBase=True,
                flags=pybullet.URDF_ENABLE_CACHED_GRAPHICS_SHAPES,
                physicsClientId=world,
            )
        for link in range(-1, pybullet.getNumJoints(body, world)):
            pybullet.changeDynamics(
                body,
                link,
                lateralFriction=tool.friction,
                linearDamping=0.0,
                angularDamping=0.0,
                jointDamping=0.0,
                physicsClientId=world,
            )
        return _OnPanda(world, body, self, pose)

    def hand_frame(self, held: Floats) -> Floats:
        """Return the hand's frame (4, 4), in the base's coordinates, that puts the held point at `held` (3,)."""
        frame = np.eye(4)
        frame[:3, 3] = held - np.array(self.base)
        cos, sin = np.cos(BASE_TURN), np.sin(BASE_TURN)
        to_base = np.array([[cos, sin, 0.0, 0.0], [-sin, cos, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
        result: Floats = to_base @ frame @ GRIP
        return result

    def first_posture(self, held: Floats) -> kinematics.Posture:
        """Return the initial posture: turned towards the held point (3,), then as near to rest as possible."""
        way = held - np.array(self.base)
        start = kinematics.READY.copy()
        start[0] = np.arctan2(way[1], way[0]) - BASE_TURN
        wanted = self.hand_frame(held)
        return kinematics.solve(wanted, kinematics.solve(wanted, start, kinematics.READY).angles, kinematics.READY)


class _OnPanda(HeldTool):
    """A tool in the hand of a Panda.

    In each control step, inverse kinematics finds the posture for the commanded point, starting from the last one, and
    the joints' reference moves there at constant speed. In each physics step, torques track the reference like a spring
    and a damper, compensating for the arm's inertia and weight (computed torque; Spong, Hutchinson, Vidyasagar 2006).
    """

    def __init__(self, world: int | None, body: int, arm: PandaArm, pose: Sequence[float]) -> None:
        super().__init__()
        self.world, self.body, self.arm = world, body, arm
        names = self._link_names()
        self.tool_link = names.index(TOOL_LINK)
        self._joints = list(range(len(kinematics.LOWEST)))
        self._command = np.array(pose, dtype=np.float64)
        posture = arm.first_posture(self._command)
        self.report.unreachable_steps += not posture.reached
        self._reference = posture.angles
        self._speed = np.zeros(len(self._joints))
        for joint, angle in zip(self._joints, posture.angles.tolist(), strict=True):
            pybullet.resetJointState(body, joint, angle, physicsClientId=world)
        # PyBullet creates every joint with an active velocity motor, which would resist the torques of `advance`.
        pybullet.setJointMotorControlArray(
            body, self._joints, pybullet.VELOCITY_CONTROL, forces=[0.0] * len(self._joints), physicsClientId=world
        )
        self._scene, self._objects = self._other_bodies()
        self._colliding = self._link_pairs()

    def drive(self, velocity: Sequence[float]) -> None:
        """Set the joints' speeds for the next control step."""
        period, now = self.arm.clock.control_period, np.array(self.read())
        wanted = self._command + period * np.array(velocity)
        # Without the leash the command would run ahead of a blocked arm, and the spring's force would grow with it.
        away = wanted - now
        wanted = now + away * min(1.0, LEASH / max(float(np.linalg.norm(away)), 1e-9))
        posture = kinematics.solve(self.arm.hand_frame(wanted), self._reference, kinematics.READY)
        speed = (posture.angles - self._reference) / period
        # All joints are slowed by the same factor, so the hand stays on its path instead of bending towards the joints
        # that are not at their limit.
        haste = float((np.abs(speed) / kinematics.FASTEST).max())
        self._speed = speed / max(1.0, haste)
        self._command = wanted
        self.report.unreachable_steps += not posture.reached
        self.report.joint_limit_steps += bool(posture.at_limit.any())
        self.report.velocity_limit_steps += haste > 1.0

    def advance(self, steps: int) -> None:
        """Take `steps` physics steps, then record events."""
        duration, strained = self.arm.clock.period, False
        for _ in range(steps):
            states = pybullet.getJointStates(self.body, self._joints, self.world)
            angles, speeds = (np.array([state[entry] for state in states]) for entry in (0, 1))
            self._reference = self._reference + duration * self._speed
            wanted = STIFFNESS * (self._reference - angles) + DAMPING * (self._speed - speeds)
            # Torques that give the wanted accelerations with the arm's inertia and weight compensated. The same
            # stiffness then holds in every posture; a plain spring would sag under the arm's weight.
            torque = np.array(
                pybullet.calculateInverseDynamics(
                    self.body, angles.tolist(), speeds.tolist(), wanted.tolist(), physicsClientId=self.world
                )
            )
            allowed = np.clip(torque, -kinematics.STRONGEST, kinematics.STRONGEST)
            strained |= bool((allowed != torque).any())
            pybullet.setJointMotorControlArray(
                self.body,
                self._joints,
                pybullet.TORQUE_CONTROL,
                forces=allowed.tolist(),
                physicsClientId=self.world,
            )
            pybullet.stepSimulation(self.world)
        self.report.torque_limit_steps += strained
        self._look()

    def read(self) -> list[float]:
        """Return the position of the held point."""
        state = pybullet.getLinkState(
            self.body, self.tool_link, computeForwardKinematics=True, physicsClientId=self.world
        )
        return list(state[4])

    def _look(self) -> None:
        """Record the events of the last control step."""
        report = self.report
        error = float(np.linalg.norm(self._command - np.array(self.read())))
        report.steps += 1
        report.tracking_error_sum += error
        report.tracking_error_max = max(report.tracking_error_max, error)
        report.scene_contact_steps += self._touches(self._scene)
        report.object_contact_steps += self._touches(self._objects)
        report.self_collision_steps += any(
            pybullet.getClosestPoints(self.body, self.body, -OVERLAP, first, second, physicsClientId=self.world)
            for first, second in self._colliding
        )

    def _touches(self, bodies: Iterable[int]) -> bool:
        """Return whether a moving link of the arm, other than the tool, touches one of `bodies`."""
        return any(
            point[3] not in (-1, self.tool_link) and point[8] < 0.0
            for body in bodies
            for point in pybullet.getContactPoints(self.body, body, physicsClientId=self.world)
        )

    def _link_names(self) -> list[str]:
        count = pybullet.getNumJoints(self.body, self.world)
        return [pybullet.getJointInfo(self.body, link, self.world)[12].decode() for link in range(count)]

    def _other_bodies(self) -> tuple[list[int], list[int]]:
        """Return the fixed and the loose bodies of the world, without the arm."""
        count = pybullet.getNumBodies(self.world)
        others = {pybullet.getBodyUniqueId(index, self.world) for index in range(count)} - {self.body}
        fixed = {body for body in others if pybullet.getDynamicsInfo(body, -1, self.world)[0] == 0.0}
        return sorted(fixed), sorted(others - fixed)

    def _link_pairs(self) -> list[tuple[int, int]]:
        """Return the pairs of links that must not overlap: base or arm, and links at least three further along."""
        count = pybullet.getNumJoints(self.body, self.world)
        return [(first, second) for first in range(-1, FOREARM_LINK + 1) for second in range(first + 3, count)]


def model_with_tool(tool: ToolShape) -> str:
    """Return PyBullet's model of the Panda (URDF) with closed fingers that hold a tool by its post."""
    root = ElementTree.parse(MODEL).getroot()
    for mesh in root.iter("mesh"):
        mesh.set("filename", mesh.get("filename", "").replace("package:/", str(MODEL.parent)))
    for name in ("panda_grasptarget", "panda_grasptarget_hand"):
        for element in [entry for entry in root if entry.get("name") == name]:
            root.remove(element)
    for joint in root.iter("joint"):
        if joint.get("type") == "prismatic":
            _close(joint)
    root.append(_tool_link(tool))
    root.append(_tool_joint())
    return ElementTree.tostring(root, encoding="unicode")


def _close(joint: ElementTree.Element) -> None:
    """Fix a finger at the position in which it touches the post."""
    joint.set("type", "fixed")
    origin, axis = joint.find("origin"), joint.find("axis")
    assert origin is not None, "a finger has an origin"
    assert axis is not None, "a finger has an axis"
    place = np.array(origin.get("xyz", "").split(), dtype=np.float64)
    way = np.array(axis.get("xyz", "").split(), dtype=np.float64)
    origin.set("xyz", _numbers(place + FINGER_OPENING * way))


def _tool_link(tool: ToolShape) -> ElementTree.Element:
    """Return the link of the tool with its handle, in the frame of the held point."""
    half_extents = [*tool.half_extents, *(part.half_extents for part in HANDLE)]
    centres = [*tool.centres, *(part.centre for part in HANDLE)]
    rotations = [*tool.rotations, *(part.rotation for part in HANDLE)]
    volumes = np.prod(half_extents, axis=1)
    link = ElementTree.Element("link", name=TOOL_LINK)
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "origin", xyz=_numbers(volumes @ np.array(centres) / volumes.sum()))
    ElementTree.SubElement(inertial, "mass", value=repr(tool.mass))
    # PyBullet computes the inertia from the collision shapes when it loads the model; the format wants numbers.
    ElementTree.SubElement(inertial, "inertia", ixx="1", ixy="0", ixz="0", iyy="1", iyz="0", izz="1")
    for half, centre, rotation in zip(half_extents, centres, rotations, strict=True):
        for kind in ("visual", "collision"):
            part = ElementTree.SubElement(link, kind)
            turns = pybullet.getEulerFromQuaternion(rotation)
            ElementTree.SubElement(part, "origin", xyz=_numbers(centre), rpy=_numbers(turns))
            shape = ElementTree.SubElement(part, "geometry")
            ElementTree.SubElement(shape, "box", size=_numbers(2.0 * np.array(half)))
    return link


def _tool_joint() -> ElementTree.Element:
    """Return the rigid joint between hand and held point."""
    held = np.linalg.inv(GRIP)
    roll = np.arctan2(held[2, 1], held[2, 2])
    pitch = np.arctan2(-held[2, 0], np.hypot(held[0, 0], held[1, 0]))
    yaw = np.arctan2(held[1, 0], held[0, 0])
    joint = ElementTree.Element("joint", name=f"{TOOL_LINK}_joint", type="fixed")
    ElementTree.SubElement(joint, "parent", link="panda_hand")
    ElementTree.SubElement(joint, "child", link=TOOL_LINK)
    ElementTree.SubElement(joint, "origin", xyz=_numbers(held[:3, 3]), rpy=_numbers((roll, pitch, yaw)))
    return joint


def _numbers(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
