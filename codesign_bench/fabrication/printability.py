"""Printability of a solid: mass, fit on the print bed, wall thickness.

Shapes: `N` points.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from codesign_bench.task import Floats

if TYPE_CHECKING:
    from trimesh import Trimesh

BED = (220.0, 220.0, 250.0)
"""Width, depth and height of the build volume of a common desktop printer, mm (ours)."""
LINE_WIDTH = 0.4
"""Line width of a common nozzle, mm (ours)."""
THINNEST_WALL = 2.0 * LINE_WIDTH
"""Smallest wall thickness, an inner and an outer line, mm (ours)."""
PLA_DENSITY = 1240.0
"""Density of PLA, kg/m^3 (data sheets of PLA filament)."""
CUBIC_MILLIMETRES = 1e9
"""Cubic millimetres per cubic metre."""
TURNS = np.deg2rad(np.arange(0.0, 90.0, 1.0))
"""Rotations about the vertical that are tried, rad: a quarter turn only swaps width and depth."""
AXES = "xyz"


@dataclass(frozen=True)
class Placement:
    """Placement of a solid on the bed."""

    up: str
    """Which of its axes is vertical."""
    turn: float
    """Its rotation about the vertical, degrees."""
    largest_scale: float
    """Largest scale at which it fits; below 1 it does not fit."""


@dataclass(frozen=True)
class Print:
    """Properties of a solid before printing; lengths in mm."""

    watertight: bool
    bodies: int
    volume_mm3: float
    mass_kg: float
    """Of solid PLA."""
    centre_of_mass_mm: list[float]
    """In the frame of the held point."""
    inertia_kg_m2: list[list[float]]
    """(3, 3) about the centre of mass, of solid PLA."""
    bounding_box_mm: list[float]
    """Along x, y and z."""
    bed_mm: tuple[float, float, float]
    placement: Placement
    """The best placement found."""
    fits_bed: bool
    thinnest_wall_mm: float
    thinnest_wall_allowed_mm: float
    problems: list[str]
    """Why it cannot be printed in one piece; empty if it can."""

    @property
    def printable(self) -> bool:
        """Whether it can be printed in one piece."""
        return not self.problems


def judge(mesh: Trimesh, thinnest_wall: float) -> Print:
    """Return the printability of `mesh`, in mm, whose thinnest part is `thinnest_wall` mm thick."""
    placement = place_on_bed(np.asarray(mesh.convex_hull.vertices))
    bodies, watertight = int(mesh.body_count), bool(mesh.is_volume)
    sides = np.asarray(mesh.extents)
    problems = []
    if not watertight:
        problems.append("its surface is not closed")
    if bodies != 1:
        problems.append(f"it falls into {bodies} pieces")
    fits = placement.largest_scale >= 1.0
    if not fits:
        problems.append(
            f"it fits the bed of {' x '.join(f'{side:.0f}' for side in BED)} mm only at"
            f" {placement.largest_scale:.3g} times this size"
        )
    if thinnest_wall < THINNEST_WALL:
        problems.append(f"a wall is {thinnest_wall:.2f} mm thick, less than two lines of {LINE_WIDTH} mm")
    density = PLA_DENSITY / CUBIC_MILLIMETRES
    return Print(
        watertight=watertight,
        bodies=bodies,
        volume_mm3=float(mesh.volume),
        mass_kg=density * float(mesh.volume),
        centre_of_mass_mm=np.asarray(mesh.center_mass).tolist(),
        inertia_kg_m2=(1e-6 * density * np.asarray(mesh.moment_inertia)).tolist(),
        bounding_box_mm=sides.tolist(),
        bed_mm=BED,
        placement=placement,
        fits_bed=fits,
        thinnest_wall_mm=thinnest_wall,
        thinnest_wall_allowed_mm=THINNEST_WALL,
        problems=problems,
    )


def place_on_bed(points: Floats) -> Placement:
    """Return the best placement of the convex hull of `points` (N, 3), in mm, on the bed.

    Each axis is tried as the vertical one, z first, with rotations about it in steps of one degree.
    """
    tried = []
    for up in (2, 1, 0):
        flat = np.delete(points, up, axis=1)
        for turn in TURNS:
            along = np.array([np.cos(turn), np.sin(turn)])
            sides = np.ptp(flat @ along), np.ptp(flat @ np.array([-along[1], along[0]])), np.ptp(points[:, up])
            scale = min(room / side for room, side in zip(BED, sides, strict=True))
            tried.append(Placement(AXES[up], float(np.rad2deg(turn)), float(scale)))
    return max(tried, key=lambda placement: placement.largest_scale)
