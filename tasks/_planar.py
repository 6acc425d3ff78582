"""Shared by the planar tasks: the three-link chain tool and a simulator with one pymunk space per slot.

Shapes: `B` slots, `b` the slots of a call, `D` = 5 design parameters (l1, l2, l3, theta1, theta2).
Lengths are in m, angles in rad, times in s. The chain is the paper's (section "Tool design space").
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, ClassVar, TypeAlias

import numpy as np
import pymunk
from PIL import Image, ImageDraw
from pymunk import batch

from codesign_bench.task import (
    OURS,
    Box,
    Floats,
    Frame,
    Given,
    Item,
    Numbers,
    Physics,
    PlanarPart,
    Shape,
    Simulator,
    Sketch,
    Slots,
    ToolGraph,
    Window,
    constants,
)

from ._scene import COLOURS, PICTURE_PIXELS, Clock

Point: TypeAlias = Sequence[float]
"""x and y, m."""

LINK_HALF_WIDTH: Annotated[float, Given("m", OURS)] = 0.25
"""Half the thickness of a link."""
CHAIN_SCENE = constants(__name__)
"""Constants of the tasks that use the chain."""

PLACE, VELOCITY = slice(0, 2), slice(2, 4)
"""Columns of `PlanarSimulator.bodies`: x and y (m); velocity along x and y (m/s)."""

CHAIN_GRAPH = ToolGraph(num_nodes=3, edges=((0, 1), (1, 2)), parameter_nodes=(0, 1, 2, 1, 2))
"""Three links in a row; the robot holds the free end of link 0; a joint's angle belongs to the link after it."""
LENGTH_NAMES = ("link_1_length", "link_2_length", "link_3_length")
ANGLE_NAMES = ("joint_1_angle", "joint_2_angle")
LENGTHS, ANGLES = slice(0, len(LENGTH_NAMES)), slice(len(LENGTH_NAMES), len(LENGTH_NAMES) + len(ANGLE_NAMES))
"""Positions of the links' lengths (m) and the joints' angles (rad) in a design of `chain_design_space`."""


def chain_design_space(
    length_init: tuple[float, float, float],
    length_ratio: tuple[float, float],
    angle_scale: float,
    angle_ratio: tuple[float, float],
) -> Box:
    """Return a chain's design space: length = init (1 + ratio), angle = scale * ratio; `angle_scale` in degrees."""
    lengths = {
        name: (length * (1.0 + length_ratio[0]), length * (1.0 + length_ratio[1]), "m")
        for name, length in zip(LENGTH_NAMES, length_init, strict=True)
    }
    low, high = (float(np.deg2rad(angle_scale * ratio)) for ratio in angle_ratio)
    return Box.of(**lengths, **dict.fromkeys(ANGLE_NAMES, (low, high, "rad")))


def chain_points(designs: Floats, first_link_angle: float) -> Floats:
    """Return the (b, 4, 2) points of chains (b, D) from the held end, at the origin, to the tip; m.

    The first link points along `first_link_angle` (rad, from the x axis); each joint turns the rest of the chain.
    """
    # Joint angles are relative to the link before, so a link's heading is the sum of all angles up to it.
    headings = first_link_angle + np.cumsum(np.pad(designs[:, ANGLES], ((0, 0), (1, 0))), axis=1)
    steps = designs[:, LENGTHS, None] * np.stack([np.cos(headings), np.sin(headings)], axis=-1)
    points = np.zeros((len(designs), 4, 2))
    np.cumsum(steps, axis=1, out=points[:, 1:])
    return points


def chain_material(designs: Floats, space: Box) -> Floats:
    """Return the total link length (b,) as a fraction of the largest in `space`, for designs (b, D)."""
    total: Floats = designs[:, LENGTHS].sum(axis=1) / sum(space.high[LENGTHS])
    return total


def chain_parts(points: Floats, half_width: float) -> tuple[PlanarPart, ...]:
    """Return the links of the chain `points` (4, 2)."""
    return tuple(PlanarPart(tuple(start), tuple(end), half_width) for start, end in pairwise(points.tolist()))


@dataclass(frozen=True)
class View:
    """The part of the plane that pictures show, m."""

    x: tuple[float, float]
    y: tuple[float, float]

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of a picture in pixels, both even, as video encoders require."""
        width, height = self.x[1] - self.x[0], self.y[1] - self.y[0]
        scale = PICTURE_PIXELS / max(width, height)
        return 2 * round(0.5 * scale * width), 2 * round(0.5 * scale * height)


class PlanarSimulator(Simulator):
    """One pymunk space per slot, rebuilt for every episode so that no state carries over to the next.

    All bodies of all slots are read with one buffer. A subclass fills each space in `build_space`, and adds the moving
    bodies in the same order in every episode.
    """

    view: ClassVar[View]

    def __init__(self, num_slots: int, state_size: int, num_bodies: int, clock: Clock) -> None:
        super().__init__(num_slots, state_size)
        self.clock = clock
        self.spaces: list[pymunk.Space] = [pymunk.Space() for _ in range(num_slots)]
        self.bodies: Floats = np.zeros((num_slots, num_bodies, 4))
        """(B, bodies, 4): `PLACE` and `VELOCITY` of the bodies that `build_space` added, in its order."""
        self._buffer = batch.Buffer()

    @abstractmethod
    def build_space(self, slot: int, points: Floats) -> pymunk.Space:
        """Return a new space for the slot's episode with the tool of chain `points` (4, 2), held end first."""

    def add_spaces(self, slots: Slots, points: Floats) -> None:
        """Build the spaces of `slots` for tools with chain `points` (b, 4, 2)."""
        for slot, chain in zip(slots.tolist(), points, strict=True):
            self.spaces[slot] = self.build_space(slot, chain)

    def advance(self, slots: Slots) -> None:
        """Take the physics steps of one control step in the spaces of `slots`."""
        period, steps = self.clock.period, range(self.clock.steps)
        for slot in slots.tolist():
            step = self.spaces[slot].step
            for _ in steps:
                step(period)

    def read_bodies(self, slots: Slots) -> Floats:
        """Read positions and velocities of the bodies of `slots` into `bodies` and return them, (b, bodies, 4)."""
        self._buffer.clear()
        fields = batch.BodyFields.POSITION | batch.BodyFields.VELOCITY
        for slot in slots.tolist():
            batch.get_space_bodies(self.spaces[slot], fields, self._buffer)
        rows = np.frombuffer(self._buffer.float_buf()).reshape(len(slots), -1, 4)
        # The space's static body comes last. The others keep the order in which they were added,
        # because sleeping is off.
        self.bodies[slots] = rows[:, : self.bodies.shape[1]]
        return self.bodies[slots]

    def inspect(self, slot: int) -> Physics:
        """Return the deepest overlap, the highest speed, and whether all moving bodies are within the view."""
        space, view = self.spaces[slot], self.view
        moving = [body for body in space.bodies if body.body_type == pymunk.Body.DYNAMIC]
        inside = all(
            view.x[0] <= body.position.x <= view.x[1] and view.y[0] <= body.position.y <= view.y[1] for body in moving
        )
        return Physics(
            overlap=max((overlap(space, shape) for body in moving for shape in body.shapes), default=0.0),
            speed=max((body.velocity.length for body in moving), default=0.0),
            contained=inside,
        )

    def tool_shapes(self, slot: int) -> tuple[PlanarPart, ...]:
        """Return the segments of the moving body; no other moving body has segments."""
        return tuple(
            PlanarPart((shape.a.x, shape.a.y), (shape.b.x, shape.b.y), shape.radius)
            for shape in self.spaces[slot].shapes
            if isinstance(shape, pymunk.Segment)
            and shape.body is not None
            and shape.body.body_type != pymunk.Body.STATIC
        )

    def render(self, slot: int) -> Frame:
        """Return a picture of every shape in the space and of the marks that the task adds in `mark`."""
        canvas = Canvas(self.view)
        self.mark(slot, canvas)
        for kind in (pymunk.Body.STATIC, pymunk.Body.KINEMATIC, pymunk.Body.DYNAMIC):
            for shape in self.spaces[slot].shapes:
                if shape.body is not None and shape.body.body_type == kind:
                    canvas.shape(shape, shape.body)
        return canvas.frame()

    def sketch(self, slot: int) -> Sketch:
        """Return the bodies and marks of `render` as data; the tool is the moving body of segments."""
        marks, bodies = MarkList(), []
        tool_pose: Numbers = ()
        self.mark(slot, marks)
        for kind in (pymunk.Body.STATIC, pymunk.Body.KINEMATIC, pymunk.Body.DYNAMIC):
            shapes: dict[pymunk.Body, list[pymunk.Shape]] = {}
            for shape in self.spaces[slot].shapes:
                if shape.body is not None and shape.body.body_type == kind:
                    shapes.setdefault(shape.body, []).append(shape)
            for body, own in shapes.items():
                moves = kind != pymunk.Body.STATIC
                pose: Numbers = (*body.position, body.angle) if moves else ()
                if moves and isinstance(own[0], pymunk.Segment):
                    tool_pose = pose
                else:
                    bodies.append(Item(tuple(_outline(shape, body) for shape in own), pose))
        return Sketch(Window(self.view.x, self.view.y), (*marks.items, *bodies), tool_pose, COLOURS["tool"])

    def mark(self, slot: int, canvas: Canvas) -> None:
        """Draw marks that are not bodies, e.g. a goal or a line, below the bodies. Nothing by default."""


def overlap(space: pymunk.Space, shape: pymunk.Shape) -> float:
    """Return the depth of the deepest overlap of `shape` with a shape that it may collide with, m."""
    deepest = 0.0
    for other in space.shape_query(shape):
        if other.shape is not None and other.shape.body is not shape.body:
            deepest = max(deepest, *(-point.distance for point in other.contact_point_set.points), 0.0)
    return deepest


class Canvas:
    """A picture of a part of the plane, drawn at twice its size and then scaled down for smooth edges."""

    OVERSAMPLING = 2

    def __init__(self, view: View) -> None:
        self.view = view
        self._pixels = self.OVERSAMPLING * view.size[0] / (view.x[1] - view.x[0])
        size = self.OVERSAMPLING * view.size[0], self.OVERSAMPLING * view.size[1]
        self._image = Image.new("RGB", size, COLOURS["background"])
        self._draw = ImageDraw.Draw(self._image)

    def shape(self, shape: pymunk.Shape, body: pymunk.Body) -> None:
        """Draw a circle, segment or polygon of `body` in the colour of its body type."""
        colour = _colour(shape, body)
        if isinstance(shape, pymunk.Circle):
            self.circle(body.local_to_world(shape.offset), shape.radius, colour)
        elif isinstance(shape, pymunk.Segment):
            self.segment(body.local_to_world(shape.a), body.local_to_world(shape.b), shape.radius, colour)
        elif isinstance(shape, pymunk.Poly):
            self._draw.polygon([self._at(body.local_to_world(vertex)) for vertex in shape.get_vertices()], fill=colour)

    def circle(self, centre: Point, radius: float, colour: str, *, filled: bool = True) -> None:
        """Draw a disc, or its outline; `radius` in m."""
        (x, y), r = self._at(centre), radius * self._pixels
        box = (x - r, y - r, x + r, y + r)
        if filled:
            self._draw.ellipse(box, fill=colour)
        else:
            self._draw.ellipse(box, outline=colour, width=3 * self.OVERSAMPLING)

    def segment(self, start: Point, end: Point, radius: float, colour: str) -> None:
        """Draw a segment with round ends; `radius` is half its thickness, m."""
        width = max(2 * self.OVERSAMPLING, round(2.0 * radius * self._pixels))
        self._draw.line([self._at(start), self._at(end)], fill=colour, width=width)
        for point in (start, end):
            self.circle(point, 0.5 * width / self._pixels, colour)

    def frame(self) -> Frame:
        """Return the picture, (height, width, 3), in RGB."""
        return np.asarray(self._image.resize(self.view.size, Image.Resampling.LANCZOS))

    def _at(self, point: Point) -> tuple[float, float]:
        return (point[0] - self.view.x[0]) * self._pixels, (self.view.y[1] - point[1]) * self._pixels


class MarkList(Canvas):
    """Keeps what is drawn on it as items instead of pixels."""

    def __init__(self) -> None:  # no picture, so not the parent's
        self.items: list[Item] = []

    def circle(self, centre: Point, radius: float, colour: str, *, filled: bool = True) -> None:
        """Keep a disc, or its outline."""
        x, y = (float(value) for value in centre)
        shape = Shape("disc" if filled else "ring", colour, ((0.0, 0.0),), (radius,))
        self.items.append(Item((shape,), (x, y, 0.0)))

    def segment(self, start: Point, end: Point, radius: float, colour: str) -> None:
        """Keep a segment."""
        (x, y), (x_end, y_end) = ([float(value) for value in point] for point in (start, end))
        shape = Shape("segment", colour, ((0.0, 0.0), (x_end - x, y_end - y)), (radius,))
        self.items.append(Item((shape,), (x, y, 0.0)))


def _outline(shape: pymunk.Shape, body: pymunk.Body) -> Shape:
    """Return a circle, segment or polygon in the frame of its body."""
    colour = _colour(shape, body)
    if isinstance(shape, pymunk.Circle):
        return Shape("disc", colour, (tuple(shape.offset),), (shape.radius,))
    if isinstance(shape, pymunk.Segment):
        return Shape("segment", colour, (tuple(shape.a), tuple(shape.b)), (shape.radius,))
    assert isinstance(shape, pymunk.Poly)
    return Shape("polygon", colour, tuple(tuple(vertex) for vertex in shape.get_vertices()))


def _colour(shape: pymunk.Shape, body: pymunk.Body) -> str:
    """Return the shape's own colour, or that of its body's type."""
    kind = {pymunk.Body.DYNAMIC: "object", pymunk.Body.STATIC: "scene", pymunk.Body.KINEMATIC: "tool"}
    colour: str = getattr(shape, "colour", COLOURS[kind[body.body_type]])
    return colour


def chain_tool(points: Floats, friction: float) -> tuple[pymunk.Body, list[pymunk.Segment]]:
    """Return a kinematic body with one rounded segment per link of the chain `points` (4, 2).

    Links of one body do not collide with each other.
    """
    # Kinematic: the robot imposes the motion, and contact forces do not slow the tool. Mass and inertia of the chain,
    # which depend on the design, then play no part.
    body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    corners = [tuple(point) for point in points.tolist()]
    links = [pymunk.Segment(body, *ends, LINK_HALF_WIDTH) for ends in pairwise(corners)]
    for link in links:
        link.friction = friction
    return body, links
