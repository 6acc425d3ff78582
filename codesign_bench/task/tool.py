"""What a tool is: a graph of links, and the shapes that it is made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True)
class ToolGraph:
    """The tool as a graph: its links are the nodes, its joints the edges; node 0 is the link that the robot holds.

    `parameter_nodes[d]` is the node that design parameter `d` belongs to.
    """

    num_nodes: int
    edges: tuple[tuple[int, int], ...]
    parameter_nodes: tuple[int, ...]


@dataclass(frozen=True)
class BoxPart:
    """A box that a tool is made of, in the frame of the held point."""

    half_extents: tuple[float, float, float]
    """m."""
    centre: tuple[float, float, float]
    """m."""
    rotation: tuple[float, float, float, float]
    """Quaternion (x, y, z, w)."""


@dataclass(frozen=True)
class PlanarPart:
    """A straight link with round ends that a planar tool is made of, in the frame of the held point."""

    start: tuple[float, float]
    """m."""
    end: tuple[float, float]
    """m."""
    radius: float
    """Half the link's thickness, m."""


ToolPart: TypeAlias = BoxPart | PlanarPart
