"""Pictures of 3D scenes: where the camera is, and marks that are not bodies, on a picture or as data.

Lengths are in m.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw

from codesign_bench.task import Floats, Frame, Item, Shape

from ._scene import PICTURE_PIXELS

PICTURE_SHAPE = (3 * PICTURE_PIXELS // 4, PICTURE_PIXELS)
"""Height and width of a picture in pixels."""


@dataclass(frozen=True)
class Camera:
    """The viewpoint of pictures of a scene."""

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    field_of_view: float = 45.0
    """Vertical, degrees."""
    near: float = 0.1
    """Nearer objects are not drawn, e.g. to leave out a roof in a picture from above."""
    far: float = 10.0


class Marks(ABC):
    """Lines and dots at positions in a scene: what a task draws beside its bodies."""

    @abstractmethod
    def line(self, points: Floats, colour: str, width: int = 2) -> None:
        """Draw a line through `points` (n, 3), m; `width` in pixels."""

    @abstractmethod
    def dot(self, point: Floats, colour: str, radius: int = 3) -> None:
        """Draw a disc at `point` (3,), m; `radius` in pixels."""


class PictureMarks(Marks):
    """Marks on a picture of the scene."""

    def __init__(self, pixels: Frame, to_clip: Floats) -> None:
        self._image = Image.fromarray(pixels)
        self._draw = ImageDraw.Draw(self._image)
        self._to_clip = to_clip

    def line(self, points: Floats, colour: str, width: int = 2) -> None:
        """Draw a line."""
        self._draw.line([tuple(pixel) for pixel in self._at(points).tolist()], fill=colour, width=width)

    def dot(self, point: Floats, colour: str, radius: int = 3) -> None:
        """Draw a disc."""
        ((x, y),) = self._at(point[None, :3]).tolist()
        self._draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=colour)

    def frame(self) -> Frame:
        """Return the picture, (height, width, 3), in RGB."""
        return np.array(self._image)

    def _at(self, points: Floats) -> Floats:
        # Homogeneous coordinates times the transposed matrices of OpenGL: after division by the last coordinate, the
        # visible part is [-1, 1], with y upwards, whereas rows of pixels count downwards.
        clip = np.pad(points, ((0, 0), (0, 1)), constant_values=1.0) @ self._to_clip
        shares = 0.5 + 0.5 * clip[:, :2] / clip[:, 3:]
        place: Floats = np.array(self._image.size) * np.stack([shares[:, 0], 1.0 - shares[:, 1]], axis=1)
        return place


class MarkList(Marks):
    """Marks that are kept as items instead of pixels."""

    def __init__(self) -> None:
        self.items: list[Item] = []

    def line(self, points: Floats, colour: str, width: int = 2) -> None:
        """Keep a line."""
        first = points[0, :3]
        corners = tuple(tuple(corner) for corner in (points[:, :3] - first).tolist())
        self.items.append(Item((Shape("line", colour, corners, (float(width),)),), tuple(first.tolist())))

    def dot(self, point: Floats, colour: str, radius: int = 3) -> None:
        """Keep a disc."""
        shape = Shape("dot", colour, ((0.0, 0.0, 0.0),), (float(radius),))
        self.items.append(Item((shape,), tuple(point[:3].tolist())))
