"""Compare curves with those of other results: `codesign-bench plot --compare`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from codesign_bench.storage.cells import find_cells
from codesign_bench.storage.frames import LABEL_COLUMN, stored_curves
from codesign_bench.storage.provenance import differences, records_of

if TYPE_CHECKING:
    import pandas as pd

FROM = " from "
"""Separates a method's name from the folder of its compared results."""


def with_compared(own: pd.DataFrame, other: Path) -> pd.DataFrame:
    """Return the curves of `own`, followed by those of `other` on the same tasks.

    A compared method is named "METHOD from FOLDER", also in its label, so that figures distinguish it.

    Args:
        own: rows of `load_results`.
        other: a results folder.

    Raises:
        UserError: there are no results in `other`.
    """
    import pandas as pd

    compared = stored_curves(other)
    compared = compared[compared["task"].isin(set(own["task"]))]
    origin = FROM + other.resolve().name
    renamed = {name: compared[name] + origin for name in ("method", LABEL_COLUMN)}
    return pd.concat([own, compared.assign(**renamed)], ignore_index=True)


def made_otherwise(own: Path, other: Path) -> list[str]:
    """Return in a short paragraph how the finished cells of two results folders were made otherwise, on shared tasks.

    Raises:
        UserError: one of the folders does not exist.
    """
    records = {folder: records_of(find_cells(folder)) for folder in (own, other)}
    shared = {record.task for record in records[own]} & {record.task for record in records[other]}
    names = _names(own, other)
    return differences(
        {names[folder]: [record for record in found if record.task in shared] for folder, found in records.items()}
    )


def _names(own: Path, other: Path) -> dict[Path, str]:
    """Return a name for each of two folders: its last part, or the whole path where that is the same for both."""
    short = {folder: folder.resolve().name for folder in (own, other)}
    return short if len(set(short.values())) == 2 else {folder: str(folder) for folder in (own, other)}


def method_of(name: str) -> str:
    """Return the method of a name, with or without a folder of compared results."""
    return name.partition(FROM)[0]


def is_compared(name: str) -> bool:
    """Return whether a name is that of compared results."""
    return FROM in name
