"""A scene as data instead of pixels: what a page or another program needs to draw it.

A simulator returns a `Sketch` of a slot; bodies with the same shapes in two sketches differ only in their poses.
Lengths are in m, angles in rad. Rotations are quaternions (x, y, z, w).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

Numbers: TypeAlias = tuple[float, ...]


@dataclass(frozen=True)
class Shape:
    """One shape of an item, in the item's own frame.

    | kind | points | size |
    | --- | --- | --- |
    | disc, ring, ball | the centre | the radius, m |
    | segment | both ends | half the thickness, m |
    | polygon | the corners | |
    | box | the centre | the half extents, m; `rotation` turns it |
    | line | the corners | the width, pixels |
    | dot | the centre | the radius, pixels |
    """

    kind: str
    colour: str
    """#rrggbb"""
    points: tuple[Numbers, ...]
    size: Numbers = ()
    rotation: Numbers = ()
    """A quaternion, for boxes."""


@dataclass(frozen=True)
class Item:
    """Shapes that move together."""

    shapes: tuple[Shape, ...]
    pose: Numbers = ()
    """() at rest in the scene's frame; (x, y, angle) in a plane; (x, y, z), or with a quaternion behind, in space."""


@dataclass(frozen=True)
class Window:
    """The part of a plane that is shown."""

    x: tuple[float, float]
    y: tuple[float, float]


@dataclass(frozen=True)
class Viewpoint:
    """The camera of a scene in space."""

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float]
    field_of_view: float
    """Vertical, degrees."""
    near: float
    """Nearer objects are not drawn, m."""
    aspect: float
    """Width of the picture divided by its height."""


@dataclass(frozen=True)
class Sketch:
    """A scene at one moment."""

    view: Window | Viewpoint
    items: tuple[Item, ...]
    """Everything but the tool, in the order of drawing."""
    tool_pose: Numbers = ()
    """Pose of the held point, as of an item; the parts of `Task.tool_parts` are in its frame."""
    tool_colour: str = "#2c6fbb"
