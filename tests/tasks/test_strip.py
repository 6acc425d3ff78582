"""The strip: seven segments in a row, held in the middle, and no bump where two of them meet."""

from __future__ import annotations

from importlib import import_module
from itertools import pairwise
from typing import Any

import numpy as np
import pymunk
import pytest

pytestmark = pytest.mark.numeric

strip: Any = import_module("codesign_bench.tasks._strip")
FLAT = np.stack([np.linspace(-3.5, 3.5, strip.SEGMENTS + 1), np.zeros(strip.SEGMENTS + 1)], axis=1)
"""Points of a straight, level strip with segments of 1 m."""


def test_the_held_segment_is_the_first_node_and_neighbours_are_joined() -> None:
    graph = strip.strip_graph(tuple(range(strip.SEGMENTS)))
    assert graph.parameter_nodes[strip.MIDDLE] == 0
    assert sorted(graph.parameter_nodes) == list(range(strip.SEGMENTS))
    joined = {frozenset(edge) for edge in graph.edges}
    assert joined == {frozenset(pair) for pair in pairwise(graph.parameter_nodes)}


def test_parts_are_in_the_order_of_the_nodes() -> None:
    graph, parts = strip.strip_graph(tuple(range(strip.SEGMENTS))), strip.strip_parts(FLAT)
    for segment, node in enumerate(graph.parameter_nodes):
        assert parts[node].start == tuple(FLAT[segment])
        assert parts[node].end == tuple(FLAT[segment + 1])


def test_lengths_are_measured_along_the_segments() -> None:
    zigzag = np.stack([3.0 * np.arange(8), np.array([0.0, 4.0] * 4)], axis=1)
    np.testing.assert_allclose(strip.strip_lengths(np.stack([FLAT, zigzag])), [7.0, 35.0])


@pytest.mark.parametrize("place", [0.5, 0.55, 0.6, 0.45, 1.5, -2.5, 0.0])
def test_a_ball_bounces_straight_up_from_a_level_strip_even_beside_a_joint(place: float) -> None:
    space = pymunk.Space()
    space.gravity = (0.0, -10.0)
    body, shapes = strip.strip_tool(FLAT, friction=0.0, elasticity=0.8)
    ball = pymunk.Body(1.0, float("inf"))
    ball.position, ball.velocity = (place, 0.5), (0.0, -8.0)
    disc = pymunk.Circle(ball, 0.2)
    disc.elasticity = 1.0
    space.add(body, *shapes, ball, disc)
    for _ in range(24):
        space.step(1.0 / 240.0)
    assert ball.velocity.y > 5.0
    assert ball.velocity.x == pytest.approx(0.0, abs=1e-9)
