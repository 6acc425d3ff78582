"""What planar tasks share: the chain of three links, by hand."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import pytest

pytestmark = pytest.mark.numeric

planar: Any = import_module("codesign_bench.tasks._planar")
QUARTER = np.pi / 2.0


def test_the_points_of_a_chain_by_hand() -> None:
    straight = planar.chain_points(np.array([[1.0, 2.0, 3.0, 0.0, 0.0]]), 0.0)
    np.testing.assert_allclose(straight, [[[0, 0], [1, 0], [3, 0], [6, 0]]], atol=1e-12)
    stairs = planar.chain_points(np.array([[1.0, 2.0, 3.0, QUARTER, -QUARTER]]), 0.0)
    np.testing.assert_allclose(stairs, [[[0, 0], [1, 0], [1, 2], [4, 2]]], atol=1e-12)
    hook = planar.chain_points(np.array([[1.0, 2.0, 3.0, QUARTER, QUARTER]]), np.pi)
    np.testing.assert_allclose(hook, [[[0, 0], [-1, 0], [-1, -2], [2, -2]]], atol=1e-12)


def test_the_design_space_of_a_chain_by_hand() -> None:
    space = planar.chain_design_space((2.0, 1.0, 1.0), (-0.5, 2.0), 60.0, (-1.0, 0.5))
    assert space.names == (*planar.LENGTH_NAMES, *planar.ANGLE_NAMES)
    assert space.low[planar.LENGTHS] == (1.0, 0.5, 0.5)
    assert space.high[planar.LENGTHS] == (6.0, 3.0, 3.0)
    np.testing.assert_allclose(np.rad2deg(space.low[planar.ANGLES]), [-60.0, -60.0])
    np.testing.assert_allclose(np.rad2deg(space.high[planar.ANGLES]), [30.0, 30.0])


def test_the_material_of_a_chain_is_the_share_of_the_largest_total_length() -> None:
    space = planar.chain_design_space((2.0, 1.0, 1.0), (-0.5, 0.5), 60.0, (-1.0, 1.0))
    designs = np.array([[3.0, 1.5, 1.5, 0.0, 0.0], [1.0, 1.0, 1.0, 0.5, -0.5]])
    np.testing.assert_allclose(planar.chain_material(designs, space), [1.0, 0.5])
