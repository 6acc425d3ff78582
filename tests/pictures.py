"""What tests of figures of pictures share: small pictures, rows of frames that hold them, and where they were drawn."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from numpy.typing import NDArray


def picture(row: int, column: int, *, height: int = 90, width: int = 120) -> NDArray[np.uint8]:
    """Return a white picture with a black square of 10 pixels whose upper left corner is at row, column."""
    result = np.full((height, width, 3), 255, dtype=np.uint8)
    result[row : row + 10, column : column + 10] = 0
    return result


def tool(task: str, row: int, column: int, **values: Any) -> dict[str, Any]:
    """Return the row of a picture of a tool, on a map of two goal entries unless `up` says otherwise."""
    return {
        **{"task": task, "title": task.title(), "method": "gnn_ppo", "label": "GNN-PPO", "variant": "default"},
        **{"alpha": np.nan, "seed": 3, "instance": 10 * row + column, "row": row, "column": column, "success": 1},
        **{"across": "goal x", "up": "goal y", "goal": f"goal x: {column} m", "picture": picture(10 * row, 30)},
        **values,
    }


def framed(figure: Figure | SubFigure) -> dict[str, Axes]:
    """Return the axes that hold pictures by their names."""
    return {str(axes.get_gid()): axes for axes in figure.axes if axes.images}
