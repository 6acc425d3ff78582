"""Marks on pictures of 3D scenes: they land where the camera sees their positions, or are kept as data."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

marks: Any = import_module("codesign_bench.tasks._marks")

WHITE, RED = 255, "#ff0000"


def white() -> np.ndarray:
    """Return an empty picture, 40 pixels high and 80 wide."""
    return np.full((40, 80, 3), WHITE, dtype=np.uint8)


def coloured(picture: np.ndarray) -> np.ndarray:
    """Return the rows and columns of all pixels that are not white, (n, 2)."""
    return np.argwhere((picture != WHITE).any(axis=2))


def test_a_dot_lies_where_the_matrix_puts_it() -> None:
    # Without a perspective, the scene's x and y are shares of half a picture, from its centre to the right and upwards.
    drawn = marks.PictureMarks(white(), np.eye(4))
    drawn.dot(np.array([0.5, 0.5, 0.0]), RED, radius=2)
    rows, columns = coloured(drawn.frame()).T
    assert (rows.mean(), columns.mean()) == (10.0, 60.0)
    assert np.ptp(rows) == np.ptp(columns) == 4
    assert drawn.frame()[10, 60].tolist() == [255, 0, 0]


def test_twice_as_far_is_half_as_far_from_the_centre() -> None:
    # The last coordinate of a point (x, y, z, 1) times this matrix is z, its distance.
    perspective = np.diag([1.0, 1.0, 1.0, 0.0])
    perspective[2, 3] = 1.0
    columns = []
    for distance in (1.0, 2.0):
        drawn = marks.PictureMarks(white(), perspective)
        drawn.dot(np.array([0.5, 0.0, distance]), RED, radius=1)
        columns.append(coloured(drawn.frame())[:, 1].mean() - 40.0)
    assert columns == [20.0, 10.0]


def test_a_line_goes_through_its_points() -> None:
    drawn = marks.PictureMarks(white(), np.eye(4))
    drawn.line(np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]]), RED, width=1)
    rows, columns = coloured(drawn.frame()).T
    assert set(rows) == {20}
    assert (columns.min(), columns.max()) == (20, 60)


def test_a_list_keeps_marks_as_items_in_metres() -> None:
    kept = marks.MarkList()
    kept.dot(np.array([0.1, 0.2, 0.3]), RED, radius=4)
    kept.line(np.array([[1.0, 0.0, 0.0], [1.0, 2.0, 0.0]]), RED, width=3)
    dot, line = kept.items
    assert (dot.shapes[0].kind, dot.pose, dot.shapes[0].size) == ("dot", (0.1, 0.2, 0.3), (4.0,))
    assert line.pose == (1.0, 0.0, 0.0)
    assert line.shapes[0].points == ((0.0, 0.0, 0.0), (0.0, 2.0, 0.0)), "from the first point on"
