"""Pictures of scenes in figures: cropped to the relevant part, with a frame and without axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import rgb_to_hsv, to_rgb
from numpy.typing import NDArray

from codesign_bench.figures.designed_tools import TOOL_COLOUR

Picture: TypeAlias = NDArray[np.uint8]
"""(height, width, 3) in RGB."""

MARGIN = 0.04
"""Margin around the kept part, as a fraction of the picture's longer side."""
MOST_CUT = 0.3
"""Largest fraction of a picture's width or height that is cut off; more would make pixels visible."""
SAME = 12
"""Colours count as equal if every channel differs by less than this; rendering is not exact."""
SAME_HUE, LEAST_SATURATION = 0.04, 0.3
"""Of a tool's pixels; hues are from 0 to 1."""
FRAME_COLOUR, FRAME_WIDTH = "#999999", 0.5


def cut_to_differences(pictures: Sequence[Picture], *, aspect: float = 4 / 3) -> list[Picture]:
    """Crop all pictures to the part in which any of them differs from the first, or shows a tool in the usual colour.

    A tool may be the same in all of them, and nothing else may differ near it. Where there is neither, the whole is
    kept.

    Args:
        pictures: pictures of the same size.
        aspect: width / height of the result, as far as possible.
    """
    stack = np.stack(pictures).astype(np.int16)
    differs = np.abs(stack - stack[0]).max(axis=-1) > SAME
    rows, columns = _box((differs | _is_tool(stack)).any(axis=0), aspect)
    return [picture[rows, columns] for picture in pictures]


def _is_tool(pictures: NDArray[np.int16]) -> NDArray[np.bool_]:
    """Return which pixels of pictures (..., 3) have the hue of tools; light and shade change the hue little."""
    hue, saturation, _ = np.moveaxis(rgb_to_hsv(pictures / 255.0), -1, 0)
    return (np.abs(hue - rgb_to_hsv(to_rgb(TOOL_COLOUR))[0]) < SAME_HUE) & (saturation > LEAST_SATURATION)


def cut_to_content(picture: Picture, *, aspect: float = 4 / 3) -> Picture:
    """Cut off margins in the colour of the picture's upper left corner, at most `MOST_CUT`.

    If the result is too high for `aspect` (width / height), it loses the same amount at top and bottom.
    """
    difference = np.abs(picture.astype(np.int16) - picture[0, 0].astype(np.int16)).max(axis=-1)
    rows, columns = _box(difference > SAME, aspect)
    height, width = picture.shape[:2]
    rows = _widen(rows.start, rows.stop, round((1.0 - MOST_CUT) * height), height)
    columns = _widen(columns.start, columns.stop, round((1.0 - MOST_CUT) * width), width)
    surplus = max(0, rows.stop - rows.start - round((columns.stop - columns.start) / aspect))
    return picture[rows.start + surplus // 2 : rows.stop - (surplus - surplus // 2), columns]


def show(axes: Axes, picture: Picture) -> Any:
    """Draw a picture that fills `axes`, in a thin frame and without ticks; return the image."""
    image = axes.imshow(picture, interpolation="antialiased")
    axes.grid(visible=False)
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set(visible=True, color=FRAME_COLOUR, linewidth=FRAME_WIDTH)
    return image


def _box(mask: NDArray[np.bool_], aspect: float) -> tuple[slice, slice]:
    """Return rows and columns of the smallest box with this aspect around the mask, with a margin."""
    height, width = mask.shape
    if not mask.any():
        return slice(0, height), slice(0, width)
    margin = round(MARGIN * max(height, width))
    spans = []
    for axis, size in ((1, height), (0, width)):
        found = np.flatnonzero(mask.any(axis=axis))
        spans.append((max(0, int(found[0]) - margin), min(size, int(found[-1]) + 1 + margin)))
    (top, bottom), (left, right) = spans
    rows = _widen(top, bottom, round((right - left) / aspect), height)
    columns = _widen(left, right, round((bottom - top) * aspect), width)
    return rows, columns


def _widen(start: int, stop: int, length: int, size: int) -> slice:
    """Return a slice of at least `length` around start..stop, within `size`."""
    length = min(max(length, stop - start), size)
    first = min(max(0, (start + stop - length) // 2), size - length)
    return slice(first, first + length)
