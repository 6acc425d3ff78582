"""Results as tidy frames: every row identifies its cell, including every axis of its variant."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from codesign_bench.cell.axes import axis_named, keeps_returns
from codesign_bench.cell.variant import DEFAULT_NAME, FIRST_AXES, Value, Variant, in_axis_order
from codesign_bench.config.values import plain_type
from codesign_bench.errors import UserError
from codesign_bench.stats.normalization import normalized_score
from codesign_bench.storage.cells import StoredCell, reported_cells
from codesign_bench.storage.layout import first_run
from codesign_bench.storage.places import results_folder
from codesign_bench.storage.reading import UnusableFile
from codesign_bench.storage.reference_points import stored_references
from codesign_bench.storage.survey import survey
from codesign_bench.visible_text import on_one_line

if TYPE_CHECKING:  # pandas takes a second to import; cell processes do not need it
    import pandas as pd

SCORE_COLUMN = "normalized_score"
"""Column with the return on the scale of its task's reference points, the last of a frame."""
LABEL_COLUMN = "label"
"""Column with the method's name in figures; the other columns identify the cell."""


class LeftOutWarning(UserWarning):
    """A file of a results folder cannot be used, so rows are missing from a frame."""


def load_results(out: str | Path) -> pd.DataFrame:
    """Return every evaluation of every cell below `out`, including running and failed cells, as one tidy frame.

    `out` is a folder, an archive that `codesign-bench pack` wrote, or `reference`, the shipped results. Cells of
    tuning, which are evaluated on validation instances, are left out.

    Columns: task, method, variant, one for each axis (cutout, alpha, finetune, scratch, and any other axis of a cell;
    NaN where it is not varied), seed, label, those of `curve.csv`, then normalized_score: `return_mean` on the scale of
    the folder's reference points, 0 for a random tool held still and 1 for the best known. It is NaN where the folder
    has no points of this version of the task, and in variants with another reward or other instances.

    Files that cannot be used are left out, with a warning that names each and its reason.

    Raises:
        UserError: the folder does not exist or contains no results.
    """
    folder = results_folder(out)
    for problem in survey(folder):
        warnings.warn(on_one_line(f"left out: {problem}"), LeftOutWarning, stacklevel=2)
    return stored_curves(folder)


def stored_curves(out: str | Path, *, finished: bool = False) -> pd.DataFrame:
    """Return the frame of `load_results`; its callers say themselves what is left out.

    Args:
        out: the results folder.
        finished: whether cells are left out that are running, interrupted or failed.

    Raises:
        UserError: the folder does not exist or contains no results.
    """
    import pandas as pd

    parts = _tables_of((cell for cell in reported_cells(Path(out)) if cell.is_done or not finished), StoredCell.curve)
    if not parts:
        missing = "finished cell" if finished else "results"
        raise UserError(f"no {missing} in '{out}' yet; create some with: {first_run(out)}")
    frame = pd.concat(_with_cell_columns(Path(out), parts, "return_mean"), ignore_index=True)
    return frame.astype({"seed": int, "env_steps": int})


def load_evaluations(out: str | Path) -> pd.DataFrame:
    """Return the final result of every finished cell below `out` on each evaluation instance, as one tidy frame.

    Columns: those of `load_results` up to `label`, then `instance` (its number), `instance_<name>` and `design_<name>`
    in the task's units (NaN for the entries of other tasks), return, success, episode_length, material, effort,
    in_cutout if the task has positions, and normalized_score, as in `load_results`, of the return. Its mean over
    instances is the score of the mean return; of a single instance it may be above 1.

    Raises:
        UserError: the folder does not exist or contains no finished cell.
    """
    import pandas as pd

    parts = _tables_of((cell for cell in reported_cells(Path(out)) if cell.is_done), StoredCell.evaluation)
    if not parts:
        raise UserError(f"no finished cell in '{out}' yet; create some with: {first_run(out)}")
    numbered = [(cell, _in_front({"instance": range(len(table))}, table)) for cell, table in parts]
    return pd.concat(_with_cell_columns(Path(out), numbered, "return"), ignore_index=True).astype({"seed": int})


def default_rows(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of cells of the default variant."""
    return frame[frame["variant"] == DEFAULT_NAME]


def rows_varying(frame: pd.DataFrame, axis: str) -> pd.DataFrame:
    """Return the rows of cells that vary only this axis."""
    if axis not in frame.columns:
        return frame.iloc[:0]
    kind = plain_type(axis_named(axis).kind)  # pandas stores a column of integers and NaN as floats
    names = {value: _name(axis, kind, value) for value in frame[axis].dropna().unique()}
    return frame[frame["variant"] == frame[axis].map(names)]


def _name(axis: str, kind: type[Value], value: Any) -> str | None:
    """Return the name of the variant that varies only this axis, or None if the axis has no such value."""
    try:
        return Variant.of(**{axis: kind(value)}).name
    except ValueError:
        return None


def require_columns(frame: pd.DataFrame, columns: Sequence[str], what: str) -> None:
    """Check that a frame has rows and columns.

    Args:
        frame: to be checked.
        columns: their names.
        what: what the frame holds, for the message.

    Raises:
        UserError: rows or columns are missing; the message names them.
    """
    missing = [column for column in columns if column not in frame.columns]
    if missing:
        raise UserError(f"{what} lack the column{'s' * (len(missing) > 1)} {', '.join(missing)}")
    if frame.empty:
        raise UserError(f"{what} have no rows")


def _with_cell_columns(out: Path, parts: Sequence[tuple[StoredCell, pd.DataFrame]], earned: str) -> list[pd.DataFrame]:
    """Insert the columns that identify each cell before its table's columns, and the score of `earned` behind them.

    All tables get the same axes.
    """
    scales = stored_references(out)
    axes = in_axis_order({*FIRST_AXES, *(axis for cell, _ in parts for axis, _ in cell.record.variant)})
    result = []
    for cell, table in parts:
        record = cell.record
        columns = {
            "task": record.task,
            "method": record.method,
            "variant": record.variant.name,
            **{axis: _or_nan(record.variant.get(axis)) for axis in axes},
            "seed": record.seed,
            LABEL_COLUMN: record.label,
        }
        known = _in_front(columns, table)
        scale = scales.get((record.task, record.task_version)) if keeps_returns(record.variant) else None
        result.append(known.assign(**{SCORE_COLUMN: normalized_score(known[earned], scale)}))
    return result


def _in_front(columns: Mapping[str, Value | range], table: pd.DataFrame) -> pd.DataFrame:
    """Return a table with further columns in front, which replace columns of the same names."""
    kept = table.drop(columns=[name for name in columns if name in table.columns])
    return kept.assign(**columns)[[*columns, *kept.columns]]


def _or_nan(value: Value | None) -> Value:
    if value is None:
        return float("nan")
    return float(value) if isinstance(value, int) else value


def _tables_of(
    cells: Iterable[StoredCell], read: Callable[[StoredCell], pd.DataFrame | None]
) -> list[tuple[StoredCell, pd.DataFrame]]:
    """Return the cells whose table can be used, each with its table."""
    parts = []
    for cell in cells:
        try:
            table = read(cell)
        except UnusableFile:
            continue
        if table is not None:
            parts.append((cell, table))
    return parts
