"""A picture of a solid."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from trimesh import Trimesh

LIGHT = np.array([0.3, -0.5, 0.81])
COLOUR = np.array([0.0, 0.447, 0.698])
"""Blue of the figures' colour-blind safe palette."""
LARGEST_TRIANGLE = 1 / 15
"""Longest edge as a fraction of the picture's width: matplotlib sorts whole triangles by depth, long ones wrongly."""


def picture(mesh: Trimesh, title: str) -> bytes:
    """Return a PNG of `mesh`, in mm, seen from the front, left and above."""
    import trimesh
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    size = float(np.ptp(mesh.vertices, axis=0).max())
    vertices, faces = trimesh.remesh.subdivide_to_size(
        mesh.vertices, mesh.faces, max_edge=LARGEST_TRIANGLE * size, max_iter=20
    )
    triangles = vertices[faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    shade = 0.45 + 0.55 * np.clip(normals @ LIGHT, 0.0, 1.0)
    colours = shade[:, None] * COLOUR + 0.25 * shade[:, None] * (1.0 - COLOUR)
    figure = Figure(figsize=(4.0, 3.4))
    axes = figure.add_subplot(projection="3d")
    axes.add_collection3d(Poly3DCollection(triangles, facecolors=colours, edgecolors=colours, linewidths=0.2))
    low, high = mesh.bounds
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(np.maximum(high - low, 0.05 * size))
    axes.set_xlabel("x, mm", fontsize=7)
    axes.set_ylabel("y, mm", fontsize=7)
    axes.set_zlabel("z, mm", fontsize=7)
    axes.tick_params(labelsize=6)
    axes.view_init(elev=35.0, azim=-60.0)
    axes.set_title(title, fontsize=8)
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=130, bbox_inches="tight", pad_inches=0.25)
    return stream.getvalue()
