"""Compare curves with those of other results: `codesign-bench plot --compare`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from codesign_bench.storage.frames import LABEL_COLUMN, load_results

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

    compared = load_results(other)
    compared = compared[compared["task"].isin(set(own["task"]))]
    origin = FROM + other.resolve().name
    renamed = {name: compared[name] + origin for name in ("method", LABEL_COLUMN)}
    return pd.concat([own, compared.assign(**renamed)], ignore_index=True)


def method_of(name: str) -> str:
    """Return the method of a name, with or without a folder of compared results."""
    return name.partition(FROM)[0]


def is_compared(name: str) -> bool:
    """Return whether a name is that of compared results."""
    return FROM in name
