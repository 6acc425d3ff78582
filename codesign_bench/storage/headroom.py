"""The tables of headroom beside the cells: what other tools earn with a finished cell's controller, per instance.

OUT/headroom/<task>-<method>[-<variant>]-seed-00.csv        one row per evaluation instance, with the form `HEADROOM`
OUT/design_values/<task>-<method>[-<variant>]-seed-00.csv   one row per tool and instance, with the form `DESIGN_VALUES`

The second is of policies that judge designs themselves.

Rows are added one by one as they are measured and never replaced, also if several processes measure one cell.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import filelock

from codesign_bench.cell.variant import DEFAULT_NAME
from codesign_bench.errors import UserError
from codesign_bench.storage.files import saying_why
from codesign_bench.storage.layout import open_folder
from codesign_bench.storage.locks import locked
from codesign_bench.storage.measurements import DESIGN_VALUES, HEADROOM, REFERENCE_INSTANCES, usable, usable_tables
from codesign_bench.storage.records import CellRecord
from codesign_bench.storage.reference_points import BEST_KNOWN, INSTANCES_FILE
from codesign_bench.storage.tables import Measurements, read_table, write_table

if TYPE_CHECKING:
    import pandas as pd

FOLDER, VALUES_FOLDER = "headroom", "design_values"
TOOLS = ("designer", "best", "other", "random")
"""Whose tool: the designer's own, the best that was found, the designer's best for another goal, a random one."""
KNOWN = "known"
"""The best that is known of an instance, whoever did it."""
QUANTITIES = ("return", "success")
LOCK_SECONDS = 60.0
"""Longest wait for another process that is writing a table."""


def path_of(results: Path, record: CellRecord, folder: str = FOLDER) -> Path:
    """Return the path of the table of a cell in a folder below `results`."""
    variant = [] if record.variant.name == DEFAULT_NAME else [record.variant.name]
    name = "-".join([record.task, record.method, *variant, f"seed-{record.seed:02d}"])
    return results / folder / f"{name}.csv"


def rows_of(path: Path, kind: Measurements = HEADROOM) -> list[dict[str, Any]]:
    """Return the rows in a table of a kind, none if there is no table.

    Raises:
        UnusableFile: it cannot be used.
    """
    table = read_table(path, kind.form)
    return (
        [] if table is None else [{str(name): value for name, value in row.items()} for row in table.to_dict("records")]
    )


def of_cell(results: Path, record: CellRecord, policy: str) -> pd.DataFrame | None:
    """Return the table of a cell if it was measured with this policy on this version of the task, else None.

    Raises:
        UnusableFile: it cannot be used.
    """
    table = read_table(path_of(results, record), HEADROOM.form)
    if table is None:
        return None
    own = (table["policy"] == policy) & (table["task_version"] == record.task_version)
    return table[own].reset_index(drop=True)


def add_rows(results: Path, path: Path, rows: Sequence[Mapping[str, Any]], kind: Measurements = HEADROOM) -> None:
    """Add the rows of an instance to a table of a kind, in order of instances, unless the table has them by now.

    Raises:
        UserError: the folder is not writable, or the table cannot be used.
    """
    import pandas as pd

    open_folder(results)
    with saying_why(f"--results {results}", path):
        path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with locked(path.parent, LOCK_SECONDS):
            known = rows_of(path, kind)
            if not {row["instance"] for row in rows} & {row["instance"] for row in known}:
                table = pd.DataFrame([*known, *rows]).sort_values("instance", kind="stable")
                write_table(results, path, table)
    except filelock.Timeout:
        raise UserError(f"--results {results}: another process holds the lock of {path.parent}") from None


def load_headroom(results: Path) -> pd.DataFrame:
    """Return what was measured of all cells, one row per cell and instance.

    Columns: those of the tables, then known_return and known_success, the best known of the instance among the folder's
    reference points, NaN where there is none of this version of the task.

    Raises:
        UserError: nothing is measured yet.
    """
    import pandas as pd

    tables = usable_tables(results, HEADROOM)
    if not tables:
        raise UserError(f"not measured yet; measure it with: codesign-bench headroom --policy CELL --results {results}")
    table = pd.concat(tables, ignore_index=True)
    points = usable(results / INSTANCES_FILE, REFERENCE_INSTANCES)
    if points is None:
        return table.assign(known_return=float("nan"), known_success=float("nan"))
    known = points[points["point"] == BEST_KNOWN]
    keys = ["task", "task_version", "instance"]
    renamed = known[[*keys, *QUANTITIES]].rename(columns={name: f"{KNOWN}_{name}" for name in QUANTITIES})
    return table.merge(renamed, on=keys, how="left", validate="many_to_one")


def load_design_values(results: Path) -> pd.DataFrame:
    """Return the tools that policies judged and played, one row per cell, instance and tool, with the tables' columns.

    Raises:
        UserError: nothing is measured yet.
    """
    import pandas as pd

    tables = usable_tables(results, DESIGN_VALUES)
    if not tables:
        raise UserError(
            "no policy that judges designs itself is measured yet; measure one with: "
            f"codesign-bench headroom --policy CELL --results {results}"
        )
    return pd.concat(tables, ignore_index=True)
