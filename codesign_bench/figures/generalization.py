"""Performance on held-out goals and starts (paper, section 5.2).

Shapes: `N` evaluation instances, `P` places, `I` instance.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from codesign_bench.cell.variant import Variant
from codesign_bench.errors import UserError
from codesign_bench.evaluation.extrapolation import load_or_measure
from codesign_bench.figures.source import Request
from codesign_bench.storage.frames import default_rows, load_evaluations, rows_varying
from codesign_bench.task import Floats, Task, load_task

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import NDArray

TRAINING, CUTOUT, OUTSIDE = "training", "cutout", "outside"
"""Regions of positions: training region, cutout region, and outside of both."""
START, COMPARED, PLACE = "start", "compared", "place"
"""Kinds of rows: an evaluation instance with its outcome; an instance of a cutout region with the outcome of a policy
that was trained on everything; or a point of a fine grid that shows the regions."""

ROOM = 0.15
"""Margin of the grid around the training region, as a fraction of its extent."""
PLACES = 14_400
"""Number of points of a grid, for any number of axes."""


def outcomes_by_region(request: Request) -> pd.DataFrame:
    """Return the evaluations of all cells with a cutout, and points that show the regions.

    Cells of the same method and task that trained on the whole region are included as fraction 0, and once more on each
    cutout region: what a policy loses by not having seen a region is the distance from them, as some regions are easier
    than others. Results around the training region, which are not part of evaluations, are included if they were
    measured.

    Args:
        request: results folder and log; if the figure was named, missing results around the region are measured.

    Returns:
        Rows of kind `START` and `COMPARED`: the columns of `load_evaluations`, where cutout of `COMPARED` is the
        fraction played on; rows of kind `PLACE`: task and cutout. All have kind, region, x and y (the position; y is
        NaN where positions have one entry), x_label, y_label.

    Raises:
        UserError: no finished cell has a cutout.
    """
    import pandas as pd

    frame = load_evaluations(request.results)
    with_cutout = rows_varying(frame, "cutout")
    pairs = with_cutout[["task", "method"]].drop_duplicates()
    whole = default_rows(frame).merge(pairs).assign(cutout=0.0)
    parts = []
    inside = pd.concat([whole, with_cutout])
    for name, rows in pd.concat([inside, *_around(request, inside)]).groupby("task", sort=False):
        try:
            task = load_task(str(name))
            starts = _starts(task, rows)
            parts += [starts, *_compared(starts)]
            parts += [_places(task, float(fraction)) for fraction in np.unique(rows["cutout"])]
        except UserError as error:
            request.log(f"generalisation on {name} left out: {error}")
    if not parts:
        raise UserError(f"no finished cell with a cutout in '{request.results}'")
    return pd.concat(parts, ignore_index=True)


def _around(request: Request, inside: pd.DataFrame) -> Iterator[pd.DataFrame]:
    """Yield, for every task, method and variant of `inside`, its policies' results around the training region."""
    keys = ["task", "method", "label", "variant", "cutout"]
    for task, method, label, variant, cutout in inside[keys].drop_duplicates().itertuples(index=False):
        varied = Variant.of(cutout=cutout or None)
        try:
            table = load_or_measure(request.results, [(task, method)], request.log, request.may_measure, varied)
        except UserError as error:
            if request.named:  # otherwise not measured yet, and the region has no line
                request.log(f"around the region, {task}/{method}/{variant} left out: {error}")
            continue
        yield table.assign(label=label, variant=variant, cutout=cutout)


def regions(task: Task, instances: Floats, fraction: float) -> NDArray[np.str_]:
    """Return the region of each instance (N, I) if `fraction` of the training region is cut out; 0: no cutout.

    Raises:
        UserError: the task has no positions.
    """
    inside = task.in_region(instances)
    unseen = task.in_cutout(instances, fraction) if fraction > 0.0 else np.zeros(len(instances), dtype=bool)
    return np.where(unseen, CUTOUT, np.where(inside, TRAINING, OUTSIDE))


def _starts(task: Task, rows: pd.DataFrame) -> pd.DataFrame:
    """Return the evaluation rows of one task with their regions and positions."""
    import pandas as pd

    columns = [f"instance_{name}" for name in task.instance_space.names]
    missing = [column for column in columns if column not in rows.columns]
    if missing:
        raise UserError(f"its evaluations lack {', '.join(missing)}; they may be from another version of the task")
    parts = []
    for fraction, group in rows.groupby("cutout"):
        instances = group[columns].to_numpy(dtype=np.float64)
        region = regions(task, instances, float(str(fraction)))
        parts.append(group.assign(kind=START, region=region, **_positions(task, instances)))
    return pd.concat(parts)


def _compared(starts: pd.DataFrame) -> Iterator[pd.DataFrame]:
    """Yield, for every method and fraction, what policies that were trained on everything do in the cutout region."""
    for (method, fraction), own in starts[starts["region"] == CUTOUT].groupby(["method", "cutout"]):
        everything = starts[(starts["method"] == method) & (starts["cutout"] == 0.0) & (starts["region"] == TRAINING)]
        same = everything[everything["instance"].isin(own["instance"])]
        yield same.assign(kind=COMPARED, region=CUTOUT, cutout=float(str(fraction)))


def _places(task: Task, fraction: float) -> pd.DataFrame:
    """Return a grid of positions around the training region of one task, with their regions."""
    import pandas as pd

    index = task.position_index
    low, high = task.instance_space.bounds
    room = ROOM * (high - low)
    count = round(PLACES ** (1.0 / len(index)))
    axes = [np.linspace(low[entry] - room[entry], high[entry] + room[entry], count) for entry in index]
    places = np.stack([axis.ravel() for axis in np.meshgrid(*axes)], axis=1)
    instances = np.tile(0.5 * (low + high), (len(places), 1))
    instances[:, index] = places
    region = regions(task, instances, fraction)
    return pd.DataFrame(
        {"task": task.name, "cutout": fraction, "kind": PLACE, "region": region, **_positions(task, instances)}
    )


def _positions(task: Task, instances: Floats) -> dict[str, Floats | str]:
    """Return the position of each instance (P, I) with labels; positions of one entry have no y."""
    space = task.instance_space.part(*task.position_entries)
    labels = [f"{name.replace('_', ' ')} ({unit})" for name, unit in zip(space.names, space.units, strict=True)]
    values = [instances[:, entry] for entry in task.position_index]
    x, y = (*values, np.full(len(instances), np.nan))[:2]
    x_label, y_label = (*labels, "")[:2]
    return {"x": x, "y": y, "x_label": x_label, "y_label": y_label}
