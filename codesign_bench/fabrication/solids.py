"""A tool's parts as one watertight solid, in mm.

Shapes: `N` points, `F` triangles.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from codesign_bench.errors import UserError
from codesign_bench.task import BoxPart, Floats, PlanarPart, Task, ToolPart

if TYPE_CHECKING:
    from trimesh import Trimesh

MILLIMETRES = 1000.0
"""In a metre."""
ROUND_SECTIONS = 64
"""Sides of the polygon that stands for a round end."""
PRECISION = 1e-3
"""Finer details of a union are smoothed away, mm.

Parts that nearly touch leave slivers that the single precision of STL files would close or tear open.
"""


@dataclass(frozen=True)
class Solid:
    """One watertight body in mm, in the frame of the held point."""

    mesh: Trimesh
    fillet_volume: float
    """How much of it fills joints whose parts only touch, mm^3."""


def handle_of(task: Task) -> tuple[ToolPart, ...]:
    """Return what a gripper holds a task's printed tools by; no part where they have a handle of their own."""
    return () if task.deployment is None else task.deployment.gripper_handle()


def tool_solid(task: Task, design: Floats, scale: float = 1.0) -> Solid:
    """Return the tool of a design (D,), in the design space's units, as one solid with the gripper's handle.

    Args:
        task: whose tool.
        design: its parameters.
        scale: size of the solid over the tool's own.

    Raises:
        UserError: the extra `export` is not installed, or the task does not define the parts of its tools.
    """
    handle, tool = handle_of(task), task.tool_parts(design)
    joints = [*task.tool_graph.edges]
    # The handle's first part touches node 0, each other one the part before it.
    joints += [(len(tool) + index - 1 if index else 0, len(tool) + index) for index in range(len(handle))]
    return united([scaled(part, scale) for part in (*tool, *handle)], joints)


def united(parts: Sequence[ToolPart], joints: Iterable[tuple[int, int]]) -> Solid:
    """Return the union of `parts`; those of each of `joints` are bonded where they only touch.

    Two boxes may meet in an edge, as the leaning plates of the 3D scoop do: nothing holds them together in print. Then
    the joint is filled with the convex hull of what each part has within half the thinner one's thickness of the other.
    """
    trimesh = _trimesh()
    meshes = [part_mesh(part) for part in parts]
    fillets = []
    for first, second in joints:
        if not _is_one_solid(_union([meshes[first], meshes[second]])):
            reach = 0.5 * min(thickness(parts[first]), thickness(parts[second]))
            near = [
                trimesh.boolean.intersection([meshes[own], part_mesh(grown(parts[other], reach))], engine="manifold")
                for own, other in ((first, second), (second, first))
            ]
            fillets.append(trimesh.convex.convex_hull(np.concatenate([mesh.vertices for mesh in near])))
    bare = _union(meshes)
    whole = _without_slivers(_union([*meshes, *fillets]) if fillets else bare)
    return Solid(whole, max(0.0, float(whole.volume - bare.volume)) if fillets else 0.0)


def part_mesh(part: ToolPart) -> Trimesh:
    """Return a part as a solid in mm; planar parts are extruded to be as high as they are wide, about height 0."""
    trimesh = _trimesh()
    if isinstance(part, BoxPart):
        x, y, z, w = part.rotation
        frame = trimesh.transformations.quaternion_matrix([w, x, y, z])
        frame[:3, 3] = MILLIMETRES * np.array(part.centre)
        return trimesh.creation.box(extents=2.0 * MILLIMETRES * np.array(part.half_extents), transform=frame)
    turn = np.linspace(0.0, 2.0 * np.pi, ROUND_SECTIONS, endpoint=False)
    ring = part.radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    outline = np.concatenate([np.array(part.start) + ring, np.array(part.end) + ring])
    points = [np.column_stack([outline, np.full(len(outline), height)]) for height in (-part.radius, part.radius)]
    return trimesh.convex.convex_hull(MILLIMETRES * np.concatenate(points))


def thickness(part: ToolPart) -> float:
    """Return a part's smallest thickness, m."""
    return 2.0 * (min(part.half_extents) if isinstance(part, BoxPart) else part.radius)


def scaled(part: ToolPart, scale: float) -> ToolPart:
    """Return a part `scale` times as large, the held point staying where it is."""
    if isinstance(part, BoxPart):
        (half_x, half_y, half_z), (x, y, z) = part.half_extents, part.centre
        half_extents = (scale * half_x, scale * half_y, scale * half_z)
        return replace(part, half_extents=half_extents, centre=(scale * x, scale * y, scale * z))
    (start_x, start_y), (end_x, end_y) = part.start, part.end
    return PlanarPart((scale * start_x, scale * start_y), (scale * end_x, scale * end_y), scale * part.radius)


def grown(part: ToolPart, reach: float) -> ToolPart:
    """Return a part whose faces lie `reach` (m) further out."""
    if isinstance(part, BoxPart):
        half_x, half_y, half_z = part.half_extents
        return replace(part, half_extents=(half_x + reach, half_y + reach, half_z + reach))
    return replace(part, radius=part.radius + reach)


def _union(meshes: Sequence[Trimesh]) -> Trimesh:
    return _trimesh().boolean.union(list(meshes), engine="manifold")


def _without_slivers(mesh: Trimesh) -> Trimesh:
    import manifold3d

    corners = np.ascontiguousarray(mesh.vertices, dtype=np.float64)
    triangles = np.ascontiguousarray(mesh.faces, dtype=np.uint64)
    exact = manifold3d.Manifold(manifold3d.Mesh64(vert_properties=corners, tri_verts=triangles))
    smooth = exact.simplify(PRECISION).to_mesh64()
    return _trimesh().Trimesh(np.array(smooth.vert_properties), np.array(smooth.tri_verts), process=False)


def _is_one_solid(mesh: Trimesh) -> bool:
    return bool(mesh.is_volume and mesh.body_count == 1)


def _trimesh() -> ModuleType:
    try:
        import manifold3d  # noqa: F401  # trimesh finds its boolean engine by itself
        import trimesh
    except ModuleNotFoundError as error:
        raise UserError("export needs trimesh and manifold3d: pip install 'codesign-bench[export]'") from error
    return trimesh
