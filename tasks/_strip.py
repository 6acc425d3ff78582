"""Shared by bounce and gather: a tool of seven straight segments in a row, a strip that is held in the middle.

Shapes: `b` tools, `P` = 8 points of a strip, `K` = 7 segments. Lengths are in m, angles in rad.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated

import numpy as np
import pymunk

from codesign_bench.task import OURS, Floats, Given, PlanarPart, ToolGraph, constants

SEGMENTS = 7
"""K: an odd number, so that there is a middle one, which is held."""
MIDDLE = SEGMENTS // 2
STRIP_HALF_WIDTH: Annotated[float, Given("m", OURS)] = 0.1
"""Half the thickness of a strip."""
STRIP_SCENE = constants(__name__)
"""Constants of the tasks that use the strip."""

OUTWARDS = (*range(MIDDLE, SEGMENTS), *range(MIDDLE - 1, -1, -1))
"""Node of the tool graph -> segment, counted from the left: the held one, then those to its right, then to its left."""
NODES = tuple(OUTWARDS.index(segment) for segment in range(SEGMENTS))
"""Segment, counted from the left -> node of the tool graph."""


def strip_graph(parameter_segments: tuple[int, ...]) -> ToolGraph:
    """Return the graph of a strip: segments in a row, the middle one held.

    Args:
        parameter_segments: for each design parameter the segment, counted from the left, that it belongs to.
    """
    edges = tuple((NODES[left], NODES[right]) for left, right in pairwise(range(SEGMENTS)))
    return ToolGraph(SEGMENTS, edges, tuple(NODES[segment] for segment in parameter_segments))


def strip_parts(points: Floats) -> tuple[PlanarPart, ...]:
    """Return the segments of the strip `points` (P, 2), from left to right, in the order of the graph's nodes."""
    ends = list(pairwise(points.tolist()))
    return tuple(PlanarPart(tuple(start), tuple(end), STRIP_HALF_WIDTH) for start, end in (ends[k] for k in OUTWARDS))


def strip_tool(points: Floats, friction: float, elasticity: float = 0.0) -> tuple[pymunk.Body, list[pymunk.Segment]]:
    """Return a kinematic body with one rounded shape per segment of the strip `points` (P, 2).

    Segments of one body do not collide with each other.
    """
    body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    corners = [tuple(point) for point in points.tolist()]
    shapes = []
    for segment in OUTWARDS:
        shape = pymunk.Segment(body, corners[segment], corners[segment + 1], STRIP_HALF_WIDTH)
        # A body that overlaps a segment a little, as it does in an impact, would also touch the end of the next one,
        # from the side. With its neighbours known, the end of a segment counts only where it sticks out.
        shape.set_neighbors(corners[max(segment - 1, 0)], corners[min(segment + 2, SEGMENTS)])
        shape.friction, shape.elasticity = friction, elasticity
        shapes.append(shape)
    return body, shapes


def strip_lengths(points: Floats) -> Floats:
    """Return the lengths (b,) of strips `points` (b, P, 2), along their segments."""
    lengths: Floats = np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1)
    return lengths
