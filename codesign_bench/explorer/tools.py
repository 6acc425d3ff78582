"""The shapes of a task's tools as functions of the design that a page can evaluate.

`Task.tool_parts` is a function in Python. For tools of rigid links whose sizes and joint angles are linear in the
design, every number of every part is a sum of products of 1 or a design parameter with 1 or the cosine or sine of a
link's angle. The angles' dependence on the design is read off by differences, the weights by least squares; whether
the result is exact is measured on other designs. A tool of another kind has no such model.

Shapes: `N` designs, `D` design, `K` parts, `V` values of all parts, `J` angles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codesign_bench.errors import UserError
from codesign_bench.seeding import generator
from codesign_bench.task import EVALUATION_SEED, BoxPart, Floats, PlanarPart, Task

PLANAR, BOXES = "planar", "boxes"
VALUES = {PLANAR: 5, BOXES: 15}
"""Kind of parts -> values of one: both ends and the radius; or half extents, centre and rotation matrix, by rows."""
STEP = 1e-5
"""Difference of a normalised design parameter from which an angle's slope is computed."""
TOLERANCE = 1e-7
"""Largest error of a model, m; half extents of parts are millimetres at least."""
CHECKS = 64


@dataclass(frozen=True)
class ToolModel:
    """Values of all parts = weights times features; features are (1, design) times (1, cosines, sines)."""

    kind: str
    angles: Floats
    """(J, 1 + D) angles = angles @ (1, normalised design), rad."""
    weights: Floats
    """(V, (1 + D) (1 + 2 J))."""

    def __call__(self, designs: Floats) -> Floats:
        """Return the parts' values (N, V) of normalised `designs` (N, D)."""
        result: Floats = features(self.angles, designs) @ self.weights.T
        return result


def tool_values(task: Task, designs: Floats) -> tuple[str, Floats]:
    """Return the kind of a task's parts, and their values (N, V) for normalised `designs` (N, D).

    Raises:
        UserError: the task does not define the parts of its tools.
    """
    rows = []
    for design in task.design_space.from_unit(designs):
        parts = task.tool_parts(design)
        rows.append([value for part in parts for value in _values(part)])
    kind = PLANAR if isinstance(parts[0], PlanarPart) else BOXES
    return kind, np.array(rows)


def tool_model(task: Task) -> ToolModel | None:
    """Return the model of a task's tools, or None if its parts are not defined or are of another kind."""
    size, rng = task.design_space.size, generator(EVALUATION_SEED, f"tools of {task.name}")
    try:
        kind, middle = tool_values(task, np.zeros((1, size)))
    except UserError:
        return None
    turns = _turns(kind, tool_values(task, rng.uniform(-1.0, 1.0, (CHECKS, size)))[1])
    slopes = np.zeros((len(turns), size))
    for entry in range(size):
        step = np.zeros((2, size))
        step[:, entry] = -STEP, STEP
        ends = _angles(kind, tool_values(task, step)[1], turns)
        # Differences of angles are small, so they are taken from the nearest turn.
        slopes[:, entry] = np.angle(np.exp(1j * (ends[1] - ends[0]))) / (2.0 * STEP)
    angles = np.concatenate([_angles(kind, middle, turns).T, np.round(slopes, 9)], axis=1)
    angles = _distinct(angles[np.abs(angles[:, 1:]).max(axis=1, initial=0.0) > 0.0])
    rows = features(angles, np.zeros((1, size))).shape[1]
    designs = rng.uniform(-1.0, 1.0, (3 * rows + CHECKS, size))
    values = tool_values(task, designs)[1]
    train, check = slice(0, -CHECKS), slice(-CHECKS, None)
    weights = np.linalg.lstsq(features(angles, designs[train]), values[train], rcond=None)[0].T
    weights[np.abs(weights) < 1e-10] = 0.0
    model = ToolModel(kind, angles, weights.astype(np.float64))
    return model if np.abs(model(designs[check]) - values[check]).max() < TOLERANCE else None


def features(angles: Floats, designs: Floats) -> Floats:
    """Return (N, (1 + D) (1 + 2 J)) products of (1, design) with (1, cosines, sines) of the angles (J, 1 + D)."""
    plain = np.concatenate([np.ones((len(designs), 1)), designs], axis=1)
    turned = plain @ angles.T
    waves = np.concatenate([np.ones((len(designs), 1)), np.cos(turned), np.sin(turned)], axis=1)
    return (plain[:, :, None] * waves[:, None, :]).reshape(len(designs), -1)


def _values(part: PlanarPart | BoxPart) -> list[float]:
    if isinstance(part, PlanarPart):
        return [*part.start, *part.end, part.radius]
    x, y, z, w = part.rotation
    matrix = (
        *(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        *(2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        *(2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )
    return [*part.half_extents, *part.centre, *matrix]


def _turns(kind: str, values: Floats) -> Floats:
    """Return the axis (K, 3) about which each part turns, from values (N, V) of random designs; zero: it does not."""
    parts = values.shape[1] // VALUES[kind]
    if kind == PLANAR:
        return np.tile([0.0, 0.0, 1.0], (parts, 1))
    found = np.zeros((parts, 3))
    for part, sides in enumerate(_vectors(values)):
        best = np.linalg.norm(sides, axis=1).argmax()
        length = np.linalg.norm(sides[best])
        found[part] = sides[best] / length if length > 1e-9 else 0.0
    return found


def _angles(kind: str, values: Floats, turns: Floats) -> Floats:
    """Return the angles (N, K) of the parts about their axes `turns` (K, 3), from their values (N, V)."""
    rows = values.reshape(len(values), -1, VALUES[kind])
    if kind == PLANAR:
        return np.arctan2(rows[..., 3] - rows[..., 1], rows[..., 2] - rows[..., 0])
    sines = np.einsum("knx,kx->nk", _vectors(values), turns)
    cosines = 0.5 * (rows[..., 6] + rows[..., 10] + rows[..., 14] - 1.0)
    return np.arctan2(sines, cosines)


def _vectors(values: Floats) -> Floats:
    """Return the axis times the sine of the angle, (K, N, 3), of the boxes' rotations."""
    matrix = values.reshape(len(values), -1, VALUES[BOXES])[..., 6:].reshape(len(values), -1, 3, 3)
    x, y, z = matrix[..., 2, 1] - matrix[..., 1, 2], matrix[..., 0, 2] - matrix[..., 2, 0], matrix[..., 1, 0]
    return 0.5 * np.stack([x, y, z - matrix[..., 0, 1]], axis=-1).swapaxes(0, 1)


def _distinct(angles: Floats) -> Floats:
    """Return the angles without those whose slopes are those of another, or their negatives."""
    kept: list[Floats] = []
    for row in angles:
        if not any(np.allclose(row[1:], sign * other[1:], atol=1e-9) for other in kept for sign in (-1.0, 1.0)):
            kept.append(row)
    return np.array(kept).reshape(-1, angles.shape[1])
