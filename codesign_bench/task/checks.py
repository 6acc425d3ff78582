"""Checks at the boundary of a task: what a caller passes in, and what a task's simulator gives back.

Every check comes before the first change, so that a refused call changes nothing. Messages name both sides.

Shapes: `B` environments or slots, `b` the slots of a call, `I` instance, `S` state, `D` design, `C` control.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NoReturn, SupportsIndex

import numpy as np

from codesign_bench.task.spaces import Booleans, Box, Floats, Slots

REAL_NUMBERS = "biuf"
"""Kinds of numpy types that are real numbers."""


class NotCopied:
    """Base of classes that hold the world of a physics engine, which cannot be copied to the last bit.

    A copy would share the world, or lose what the engine remembers of contacts. `copy.copy`, `copy.deepcopy` and
    `pickle` therefore raise a `TypeError`.
    """

    def __reduce_ex__(self, protocol: SupportsIndex) -> NoReturn:
        raise TypeError(
            f"{type(self).__name__} cannot be copied or pickled, for it holds the world of a physics engine; make "
            "another one, start the same instance and take the same steps: the episode will be the same"
        )


def checked_actions(action: Any, design: Box, control: Box, count: int | None = None) -> Floats:
    """Return an action [design | control] (D + C,), or with `count` that many in rows, as finite numbers.

    Raises:
        ValueError: it has another shape, or a value is not a finite number.
    """
    size = design.size + control.size
    expected = (size,) if count is None else (count, size)
    values = _numbers(action, "the action")
    if values.shape != expected:
        raise ValueError(
            f"the action has shape {values.shape}, the action space {expected}: design ({', '.join(design.names)}), "
            f"then control ({', '.join(control.names)})"
        )
    _refuse_not_finite(values, (*design.names, *control.names), "the action", "the action space is [-1, 1]")
    return values


def checked_instance(instance: Any, space: Box, slots: Slots | None = None, count: int = 1) -> Floats:
    """Return the instances (b, I) of `slots` (b,) from `instance`, (I,) for all or (`count`, I) for every slot.

    Rows of other slots are ignored. Bounds are compared in single precision, as in observations.

    Raises:
        ValueError: it has another shape, or a value is not a finite number in the instance space.
    """
    what = "options['instance']"
    values, size = _numbers(instance, what), space.size
    if values.shape not in ((size,), (count, size)):
        shapes = f"({size},)" if slots is None else f"({size},) or ({count}, {size})"
        raise ValueError(
            f"{what} has shape {values.shape}, the instance space {shapes}: {', '.join(space.names)}",
        )
    every = np.broadcast_to(values, (count, size))
    chosen = (every if slots is None else every[slots]).copy()
    _refuse_not_finite(chosen, space.names, what, f"the instance space is {_ranges(space)}")
    low, high = space.bounds
    outside = _outside(chosen, low, high)
    if outside.any():
        row, entry = np.argwhere(outside)[0]
        raise ValueError(
            f"{what} has {space.names[entry]} = {chosen[row, entry]:g}, outside the instance space: "
            f"{low[entry]:g} to {high[entry]:g} {space.units[entry]}"
        )
    return chosen


def checked_mask(mask: Any, count: int, what: str = "options['reset_mask']") -> Slots:
    """Return the slots that a mask (`count`,) of truth values chooses; None chooses all.

    Raises:
        ValueError: it has another shape or other values, or chooses none.
    """
    if mask is None:
        return np.arange(count)
    values = np.asarray(mask)
    if values.shape != (count,) or values.dtype != np.bool_:
        raise ValueError(
            f"{what} has shape {values.shape} and type {values.dtype}, not ({count},) and bool: "
            "one truth value for each environment"
        )
    if not values.any():
        raise ValueError(f"{what} chooses none of the {count} environments")
    return np.flatnonzero(values)


def check_rows(values: Floats, slots: Slots, space: Box, what: str) -> None:
    """Check that `values` has one row for each of `slots` (b,), with the entries of `space`.

    Raises:
        ValueError: it has another shape.
    """
    if np.shape(values) != (len(slots), space.size):
        raise ValueError(
            f"{what} of shape {np.shape(values)} for {len(slots)} slots, expected ({len(slots)}, {space.size}): "
            f"{', '.join(space.names)}"
        )


def check_slots(slots: Slots, num_slots: int) -> None:
    """Check that `slots` are different slots among `num_slots`.

    Raises:
        ValueError: they are not.
    """
    found = np.asarray(slots)
    whole = found.ndim == 1 and (found.size == 0 or found.dtype.kind in "iu")
    if not whole or len(np.unique(found)) < len(found) or ((found < 0) | (found >= num_slots)).any():
        raise ValueError(f"slots {found.tolist()} are not different slots among 0 to {num_slots - 1}")


def check_finite(values: Floats, space: Box, what: str) -> None:
    """Check that all `values` (b, size) are finite.

    Raises:
        ValueError: one is not.
    """
    if not np.isfinite(values).all():
        _refuse_not_finite(values, space.names, what, f"its space is {_ranges(space)}")


def _numbers(values: Any, what: str) -> Floats:
    """Return `values` as an array of float64.

    Raises:
        ValueError: they are no array of real numbers.
    """
    try:
        found = np.asarray(values)
    except (TypeError, ValueError) as error:  # rows of different lengths
        raise ValueError(f"{what} is not an array of numbers: {error}") from error
    if found.dtype.kind not in REAL_NUMBERS:
        raise ValueError(f"{what} has type {found.dtype}, not real numbers")
    return found.astype(np.float64)


def _refuse_not_finite(values: Floats, names: Sequence[str], what: str, expected: str) -> None:
    bad: Booleans = ~np.isfinite(values)
    if bad.any():
        *row, entry = np.argwhere(bad)[0].tolist()
        place = f" in row {row[0]}" if row and len(values) > 1 else ""
        others = f" ({bad.sum()} values are not finite)" if bad.sum() > 1 else ""
        raise ValueError(f"{what} is not finite: {names[entry]} = {values[(*row, entry)]}{place}{others}; {expected}")


def _outside(values: Floats, low: Floats, high: Floats) -> Booleans:
    with np.errstate(over="ignore"):  # what single precision cannot hold becomes infinite, and is outside
        single = values.astype(np.float32)
    result: Booleans = (single < low.astype(np.float32)) | (single > high.astype(np.float32))
    return result


def _ranges(space: Box) -> str:
    return ", ".join(
        f"{name} {low:g} to {high:g} {unit}"
        for name, low, high, unit in zip(space.names, space.low, space.high, space.units, strict=True)
    )
