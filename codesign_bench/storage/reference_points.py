"""The table of reference points beside the cells: what a task gives without learning, and the best that is known.

OUT/reference_points.csv             one row per task and point, with `COLUMNS`
OUT/reference_points.instances.csv   the same per evaluation instance, with `INSTANCE_COLUMNS`
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from codesign_bench.errors import UserError
from codesign_bench.stats.normalization import Reference
from codesign_bench.storage.measurements import REFERENCE_POINTS, usable
from codesign_bench.storage.tables import read_table

if TYPE_CHECKING:
    import pandas as pd

FILE, INSTANCES_FILE = "reference_points.csv", "reference_points.instances.csv"

IDLE, RANDOM_TOOL, SCRIPT = "idle", "random_tool", "script"
SINGLE_TOOL, BEST_KNOWN = "best_single_tool", "best_known"
ANY_TOOL = "any_tool"
POINTS = (IDLE, RANDOM_TOOL, SCRIPT, SINGLE_TOOL, BEST_KNOWN)
"""In the order of tables and legends. The table also has `ANY_TOOL`, of which the best known is made."""

COLUMNS = ("task", "task_version", "point", "return_mean", "success_rate", "instances", "tools", "source")
"""`tools` counts the tools that were played for a point; for the best known, the results from which it is taken."""
INSTANCE_COLUMNS = ("task", "task_version", "point", "instance", "return", "success", "source")

QUANTITIES = ("return_mean", "success_rate")
PREFIX = "reference_"


def load_reference_points(results: Path) -> pd.DataFrame:
    """Return the reference points in a results folder, one row per task and point, with `COLUMNS`.

    Raises:
        UserError: there are none.
    """
    table = read_table(results / FILE, REFERENCE_POINTS.form)
    if table is None:
        raise UserError(f"no reference points yet; measure them with: codesign-bench reference --results {results}")
    return table


def references(points: pd.DataFrame) -> dict[str, Reference]:
    """Return the scale of every task that has both of its ends in `points`, rows as `load_reference_points` gives."""
    if points.empty:
        return {}
    returns = {(str(row["task"]), row["point"]): float(row["return_mean"]) for row in points.to_dict("records")}
    return {
        task: Reference(zero, returns[task, BEST_KNOWN])
        for (task, point), zero in returns.items()
        if point == IDLE and (task, BEST_KNOWN) in returns
    }


def stored_references(results: Path) -> dict[tuple[str, int], Reference]:
    """Return the scales of the tasks in a results folder, by name and version of the scene; none without a table."""
    table = usable(results / FILE, REFERENCE_POINTS)
    if table is None:
        return {}
    versions = table.groupby("task")["task_version"].unique()
    return {(task, int(version)): scale for task, scale in references(table).items() for version in versions[task]}


def with_reference_points(frame: pd.DataFrame, results: Path) -> pd.DataFrame:
    """Return rows of cells with the reference points of their tasks in columns, where the folder has any.

    The columns are called `reference_<point>_<quantity>`, NaN for tasks without the point, so that a figure gets cells
    and points in one frame.
    """
    table = usable(results / FILE, REFERENCE_POINTS)
    if table is None:
        return frame
    columns = {}
    for point in POINTS:
        own = table[table["point"] == point].set_index("task")
        for quantity in QUANTITIES:
            columns[f"{PREFIX}{point}_{quantity}"] = frame["task"].map(own[quantity])
    return frame.assign(**columns)


def reference_points_in(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the reference points that `with_reference_points` put into a frame: task, point, and each quantity."""
    import pandas as pd

    rows = []
    for task, group in frame.groupby("task", sort=False):
        for point in POINTS:
            values = {name: _first(group, f"{PREFIX}{point}_{name}") for name in QUANTITIES}
            if all(value == value for value in values.values()):
                rows.append({"task": task, "point": point, **values})
    return pd.DataFrame(rows, columns=["task", "point", *QUANTITIES])


def _first(frame: pd.DataFrame, column: str) -> float:
    """Return the first number in a column, NaN where there is none."""
    known = frame[column].dropna().tolist() if column in frame.columns else []
    return float(known[0]) if known else float("nan")
