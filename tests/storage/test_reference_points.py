"""Reference points as frames: read, turned into scales, and carried along with the rows of cells."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pandas as pd
import pytest

from builders import store_table
from codesign_bench.errors import UserError
from codesign_bench.stats import Reference
from codesign_bench.storage.measurements import REFERENCE_POINTS
from codesign_bench.storage.reference_points import (
    FILE,
    load_reference_points,
    reference_points_in,
    references,
    with_reference_points,
)

CELLS = pd.DataFrame({"task": ["push", "push", "scoop"], "return_mean": [1.0, 2.0, 3.0]})


def points(task: str, returns: Mapping[str, float]) -> pd.DataFrame:
    """Return the points of a task; success is a tenth of the return's size."""
    rows = [{"point": name, "return_mean": value, "success_rate": abs(value) / 10.0} for name, value in returns.items()]
    return pd.DataFrame(rows).assign(task=task)


def test_a_task_has_a_scale_if_both_of_its_ends_are_known() -> None:
    table = pd.concat(
        [points("push", {"idle": -1.0, "script": 2.0, "best_known": 3.0}), points("scoop", {"idle": 0.0})]
    )
    assert references(table) == {"push": Reference(-1.0, 3.0)}
    assert references(pd.DataFrame()) == {}


def test_a_folder_without_points_says_how_to_measure_them(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="codesign-bench reference --results"):
        load_reference_points(tmp_path)


def test_points_travel_with_the_rows_of_their_task(tmp_path: Path) -> None:
    rows = points("push", {"best_known": 3.0, "idle": -1.0, "any_tool": 2.0}).to_dict("records")
    store_table(tmp_path / FILE, REFERENCE_POINTS, *rows)
    frame = with_reference_points(CELLS, tmp_path)
    assert frame["return_mean"].tolist() == [1.0, 2.0, 3.0]
    compared = CELLS.assign(task="push")  # has no such columns, as rows of other results
    found = reference_points_in(pd.concat([compared, frame]))
    assert found.to_dict("list") == {
        "task": ["push", "push"],
        "point": ["idle", "best_known"],
        "return_mean": [-1.0, 3.0],
        "success_rate": [0.1, 0.3],
    }


def test_without_a_table_a_frame_stays_as_it_is(tmp_path: Path) -> None:
    pd.testing.assert_frame_equal(with_reference_points(CELLS, tmp_path), CELLS)
    assert reference_points_in(CELLS).empty
