"""The exported solid is the tool that the engine lets collide, in one watertight piece, for any design of any task."""

from __future__ import annotations

import io
import itertools
from collections.abc import Sequence
from functools import partial

import numpy as np
import pytest

from builders import offered
from codesign_bench import load_task, task_names
from codesign_bench.fabrication.export import SOLID_FORMATS, file_content
from codesign_bench.fabrication.solids import Solid, handle_of, tool_solid, united
from codesign_bench.task import BoxPart, Floats, PlanarPart, Simulator, Task, ToolPart, deployable_tasks, deployment_of

trimesh = pytest.importorskip("trimesh")
stats = pytest.importorskip("scipy.stats")

DESIGNS = 12
SAMPLES = 2**16
"""Points of a Sobol sequence: volumes of the tools are then right within about 0.3 %."""
LEVEL = (0.0, 0.0, 0.0, 1.0)


def random_designs(task: Task) -> Floats:
    """Return a few designs in the design space's units, its two extreme corners among them."""
    inner = task.design_space.sample(np.random.default_rng(7), DESIGNS)
    return np.concatenate([inner, np.stack(task.design_space.bounds)])


def engine_shapes(simulator: Simulator, task: Task, design: Floats) -> tuple[ToolPart, ...]:
    """Return what the engine itself holds after a tool was built."""
    slot = np.array([0])
    simulator.begin(slot, task.evaluation_instances()[:1])
    simulator.build(slot, design[None])
    return offered(partial(simulator.tool_shapes, 0))


def inside(parts: Sequence[ToolPart], points: Floats) -> np.ndarray:
    """Tell which points (N, 3), m, lie in any of the parts."""
    result = np.zeros(len(points), dtype=bool)
    for part in parts:
        if isinstance(part, BoxPart):
            x, y, z, w = part.rotation
            turn = np.array(
                [
                    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
                ]
            )
            result |= (np.abs((points - part.centre) @ turn) <= part.half_extents).all(axis=1)
        else:
            start, way = np.array(part.start), np.array(part.end) - part.start
            share = np.clip((points[:, :2] - start) @ way / (way @ way), 0.0, 1.0)
            beside = np.linalg.norm(points[:, :2] - start - share[:, None] * way, axis=1) <= part.radius
            result |= beside & (np.abs(points[:, 2]) <= part.radius)
    return result


def measured(parts: Sequence[ToolPart], low: Floats, high: Floats) -> tuple[float, Floats]:
    """Return volume (m^3) and inertia about the centre of mass (3, 3) at density 1 (m^5) of parts within a box."""
    points = low + stats.qmc.Sobol(3, seed=0).random(SAMPLES) * (high - low)
    own = points[inside(parts, points)]
    cell = float(np.prod(high - low)) / SAMPLES
    offset = own - own.mean(axis=0)
    inertia = (offset**2).sum() * np.eye(3) - offset.T @ offset
    return cell * len(own), cell * inertia


def assert_same(solid: Solid, parts: Sequence[ToolPart]) -> None:
    """Compare volume, inertia and extent; fillets at joints that only touch are no part of the engine's tool."""
    mesh = solid.mesh
    low, high = 1e-3 * mesh.bounds
    volume, inertia = measured(parts, low, high)
    fillets = 1e-9 * solid.fillet_volume
    assert 1e-9 * mesh.volume - fillets == pytest.approx(volume, rel=0.01)
    allowed = 0.01 + 2.0 * fillets / volume
    assert np.abs(1e-15 * mesh.moment_inertia - inertia).max() < allowed * np.trace(inertia)
    assert not inside(parts, low + (high - low) * _just_outside()).any(), "the tool ends where the solid does"
    for axis, side in itertools.product(range(3), (low, high)):
        slab_low, slab_high = low.copy(), high.copy()
        within = 0.01 * (high - low)[axis]
        slab_low[axis], slab_high[axis] = sorted((side[axis], side[axis] + (within if side is low else -within)))
        touched = slab_low + stats.qmc.Sobol(3, seed=1).random(2**14) * (slab_high - slab_low)
        assert inside(parts, touched).any(), "and reaches as far"


def _just_outside() -> Floats:
    """Return points (N, 3) a hundredth beyond the faces of the unit cube."""
    points = stats.qmc.Sobol(3, seed=2).random(2**14)
    faces = [np.insert(points[:, :2], axis, value, axis=1) for axis in range(3) for value in (-0.01, 1.01)]
    return np.concatenate(faces)


@pytest.mark.parametrize("name", task_names())
def test_the_solid_is_what_the_engine_lets_collide(name: str) -> None:
    task = load_task(name)
    simulator = task.make_simulator(1)
    for design in random_designs(task):
        assert_same(tool_solid(task, design), (*engine_shapes(simulator, task, design), *handle_of(task)))


@pytest.mark.parametrize("name", deployable_tasks())
def test_the_arm_holds_the_solid_handle_included(name: str) -> None:
    task = load_task(name)
    simulator = deployment_of(task).make_simulator(1, "panda")
    for design in random_designs(task)[:4]:
        assert_same(tool_solid(task, design), engine_shapes(simulator, task, design))


@pytest.mark.parametrize("kind", SOLID_FORMATS)
@pytest.mark.parametrize("name", task_names())
def test_files_hold_one_watertight_solid(name: str, kind: str) -> None:
    task = load_task(name)
    for design in random_designs(task):
        solid = tool_solid(task, design)
        read = trimesh.load_mesh(io.BytesIO(file_content(solid.mesh, kind)), file_type=kind)
        assert read.is_watertight
        assert read.is_winding_consistent
        assert read.body_count == 1
        assert read.volume == pytest.approx(solid.mesh.volume, rel=1e-4)


@pytest.mark.parametrize("name", task_names())
def test_fillets_are_small(name: str) -> None:
    task = load_task(name)
    for design in random_designs(task):
        solid = tool_solid(task, design)
        assert 0.0 <= solid.fillet_volume < 0.05 * solid.mesh.volume


def test_boxes_that_overlap_are_counted_once() -> None:
    boxes = [BoxPart((0.01, 0.01, 0.01), (x, 0.0, 0.0), LEVEL) for x in (0.0, 0.01)]
    solid = united(boxes, [(0, 1)])
    assert solid.mesh.volume == pytest.approx(30.0 * 20.0 * 20.0)
    assert solid.mesh.extents == pytest.approx([30.0, 20.0, 20.0])
    assert solid.fillet_volume == 0.0


def test_boxes_that_meet_in_an_edge_are_bonded() -> None:
    boxes = [BoxPart((0.01, 0.01, 0.01), (x, 0.0, x), LEVEL) for x in (0.0, 0.02)]
    assert united(boxes, []).mesh.body_count == 2
    solid = united(boxes, [(0, 1)])
    assert solid.mesh.is_volume
    assert solid.mesh.body_count == 1
    # Within 10 mm of each other they are two squares of 10 mm that meet in a corner; their hull adds two triangles.
    assert solid.fillet_volume == pytest.approx(2 * 0.5 * 10.0 * 10.0 * 20.0)


def test_a_planar_link_is_extruded_to_its_width() -> None:
    solid = united([PlanarPart((0.0, 0.0), (0.1, 0.0), 0.01)], [])
    assert solid.mesh.extents == pytest.approx([120.0, 20.0, 20.0])
    assert solid.mesh.volume == pytest.approx((100.0 * 20.0 + np.pi * 10.0**2) * 20.0, rel=1e-3)


@pytest.mark.parametrize("name", task_names())
def test_scale_keeps_the_shape(name: str) -> None:
    task = load_task(name)
    (design, *_) = random_designs(task)
    full, small = tool_solid(task, design), tool_solid(task, design, scale=0.1)
    tool = len(task.tool_parts(design))
    assert tool == task.tool_graph.num_nodes
    assert small.mesh.extents == pytest.approx(0.1 * full.mesh.extents, rel=1e-3)
    assert small.mesh.volume == pytest.approx(1e-3 * full.mesh.volume, rel=1e-3)
