"""A tool: a graph of links, and the shapes of its parts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True)
class ToolGraph:
    """The tool as a graph: links are nodes, joints are edges, and the robot holds node 0.

    `parameter_nodes[d]` is the node of design parameter `d`.
    """

    num_nodes: int
    edges: tuple[tuple[int, int], ...]
    parameter_nodes: tuple[int, ...]


@dataclass(frozen=True)
class BoxPart:
    """A box of a tool, in the frame of the held point."""

    half_extents: tuple[float, float, float]
    """m."""
    centre: tuple[float, float, float]
    """m."""
    rotation: tuple[float, float, float, float]
    """Quaternion (x, y, z, w)."""


@dataclass(frozen=True)
class PlanarPart:
    """A straight link with round ends of a planar tool, in the frame of the held point."""

    start: tuple[float, float]
    """m."""
    end: tuple[float, float]
    """m."""
    radius: float
    """Half the link's thickness, m."""


ToolPart: TypeAlias = BoxPart | PlanarPart
