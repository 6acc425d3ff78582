"""A picture of a solid is a PNG of that solid, and the same solid gives the same picture."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from codesign_bench.fabrication.picture import picture

trimesh = pytest.importorskip("trimesh")


def seen(mesh: trimesh.Trimesh, title: str = "tool") -> np.ndarray:
    """Return the pixels of a picture, (height, width, 3), 0 to 255."""
    with Image.open(io.BytesIO(picture(mesh, title))) as image:
        assert image.format == "PNG"
        return np.asarray(image.convert("RGB"), dtype=int)


def blue(pixels: np.ndarray) -> np.ndarray:
    """Return which pixels show the solid: bluer than they are red."""
    return pixels[..., 2] - pixels[..., 0] > 40


def test_a_solid_is_shown_in_blue_on_white() -> None:
    pixels = seen(trimesh.creation.box(extents=(40.0, 20.0, 10.0)))
    assert 0.05 < blue(pixels).mean() < 0.7
    assert (pixels == 255).all(axis=-1).mean() > 0.2


def test_its_faces_are_lit_from_one_side() -> None:
    pixels = seen(trimesh.creation.box(extents=(40.0, 40.0, 40.0)))
    shades = pixels[blue(pixels)].sum(axis=-1)
    assert np.percentile(shades, 95) > 1.3 * np.percentile(shades, 5)


def test_a_long_solid_is_not_drawn_as_high_as_it_is_long() -> None:
    def height_over_width(mesh: trimesh.Trimesh) -> float:
        rows, columns = np.nonzero(blue(seen(mesh)))
        return float(np.ptp(rows) / np.ptp(columns))

    rod, cube = (trimesh.creation.box(extents=sides) for sides in ((100.0, 10.0, 10.0), (50.0, 50.0, 50.0)))
    assert height_over_width(rod) < 0.7 * height_over_width(cube)


def test_the_same_solid_gives_the_same_picture_and_another_one_another() -> None:
    box, ball = trimesh.creation.box(extents=(30.0, 20.0, 10.0)), trimesh.creation.icosphere(radius=15.0)
    assert picture(box, "tool") == picture(box, "tool") != picture(ball, "tool")
