"""Tables beside the cells: good ones are read, whatever lies beside them."""

from __future__ import annotations

from pathlib import Path

import pytest

from builders import store_table
from codesign_bench.storage.measurements import (
    ALL,
    DESIGN_SENSITIVITY,
    REFERENCE_POINTS,
    paths_of,
    usable,
    usable_tables,
)
from codesign_bench.storage.tables import Measurements, read_table

ROOT = Path(__file__).resolve().parents[2]


def test_tables_that_cannot_be_used_are_passed_over(tmp_path: Path) -> None:
    folder = tmp_path / "design_sensitivity"
    for task in ("push", "scoop"):
        store_table(folder / f"{task}.csv", DESIGN_SENSITIVITY, {"task": task})
    (folder / "broken.csv").write_text("")
    assert len(paths_of(tmp_path, DESIGN_SENSITIVITY)) == 3
    assert [table["task"].tolist() for table in usable_tables(tmp_path, DESIGN_SENSITIVITY)] == [["push"], ["scoop"]]
    assert usable(folder / "broken.csv", DESIGN_SENSITIVITY) is None
    assert usable(tmp_path / "reference_points.csv", REFERENCE_POINTS) is None


@pytest.mark.reference
@pytest.mark.parametrize("kind", ALL, ids=lambda kind: kind.pattern)
def test_shipped_tables_have_the_forms(kind: Measurements) -> None:
    for path in paths_of(ROOT / "results" / "reference", kind):
        assert not path.exists() or read_table(path, kind.form) is not None
