"""What is said of a print, by numbers that can be checked by hand."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.fabrication.printability import PLA_DENSITY, judge, place_on_bed

trimesh = pytest.importorskip("trimesh")


def box(*sides: float) -> trimesh.Trimesh:
    """Return a solid box, sides in mm."""
    return trimesh.creation.box(extents=sides)


def test_a_box_has_the_mass_and_inertia_of_a_box() -> None:
    result = judge(box(100.0, 20.0, 10.0), thinnest_wall=10.0)
    assert result.volume_mm3 == pytest.approx(20_000.0)
    mass = PLA_DENSITY * 20e-6
    assert result.mass_kg == pytest.approx(mass) == pytest.approx(0.0248)
    sides = np.array([0.1, 0.02, 0.01])
    assert np.diag(result.inertia_kg_m2) == pytest.approx(mass / 12.0 * ((sides**2).sum() - sides**2))
    assert result.centre_of_mass_mm == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    assert result.printable
    assert result.problems == []


@pytest.mark.parametrize(
    ("sides", "up", "fits"),
    [
        ((220.0, 220.0, 250.0), "z", True),
        ((200.0, 250.0, 200.0), "y", True),
        ((250.0, 200.0, 200.0), "x", True),
        ((220.0, 220.0, 251.0), "z", False),
        ((300.0, 10.0, 10.0), "z", True),  # along the diagonal of the bed, which is 311 mm long
        ((320.0, 10.0, 10.0), "z", False),
    ],
)
def test_the_bed(sides: tuple[float, float, float], up: str, fits: bool) -> None:
    placement = place_on_bed(box(*sides).vertices)
    assert placement.up == up
    assert (placement.largest_scale >= 1.0) == fits
    assert judge(box(*sides), 10.0).fits_bed == fits


def test_a_long_rod_lies_on_the_diagonal() -> None:
    placement = place_on_bed(box(300.0, 1.0, 1.0).vertices)
    assert placement.turn == pytest.approx(45.0)
    # A rod of length l and width w, turned by 45 degrees, is (l + w) / sqrt(2) wide.
    assert placement.largest_scale == pytest.approx(220.0 / (301.0 / np.sqrt(2.0)))


def test_every_problem_is_named() -> None:
    apart = trimesh.util.concatenate([box(10.0, 10.0, 0.5), box(10.0, 10.0, 0.5).apply_translation([400.0, 0.0, 0.0])])
    result = judge(apart, thinnest_wall=0.5)
    assert not result.printable
    assert [word in " ".join(result.problems) for word in ("2 pieces", "bed", "0.50 mm")] == [True] * 3
    opened = box(10.0, 10.0, 10.0)
    opened.update_faces(np.arange(len(opened.faces)) > 0)
    assert "not closed" in " ".join(judge(opened, 10.0).problems)
