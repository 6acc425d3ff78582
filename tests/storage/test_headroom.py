"""Tables of headroom: rows are added and never replaced, and are read with what is known of their instances."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import filelock
import pytest

from builders import store_cell, store_table
from codesign_bench.cell.variant import Variant
from codesign_bench.errors import UserError
from codesign_bench.storage import headroom
from codesign_bench.storage.cells import open_cell
from codesign_bench.storage.headroom import add_rows, load_headroom, of_cell, path_of, rows_of
from codesign_bench.storage.locks import LOCK_FILE
from codesign_bench.storage.measurements import HEADROOM, REFERENCE_INSTANCES
from codesign_bench.storage.reading import UnusableFile
from codesign_bench.storage.reference_points import INSTANCES_FILE
from codesign_bench.storage.tables import Content


def row_of(instance: int, **changes: Any) -> dict[str, Any]:
    """Return a row with all columns; others hold 1 or a word."""
    names = [(name, kind) for name, kind in HEADROOM.form.columns.items() if "*" not in name]
    row = {name: "word" if kind is Content.TEXT else 1 for name, kind in names}
    return {**row, "task": "push", "instance": instance, "instance_goal": 0.5, "design_length": 0.1, **changes}


def test_rows_are_added_in_order_and_the_first_of_an_instance_stays(tmp_path: Path) -> None:
    path = tmp_path / "headroom" / "push-gnn_ppo-seed-00.csv"
    assert rows_of(path) == []
    for instance, earned in ((3, 1.0), (1, 2.0), (3, 9.0)):
        add_rows(tmp_path, path, [row_of(instance, best_return=earned)])
    assert [(row["instance"], row["best_return"]) for row in rows_of(path)] == [(1, 2.0), (3, 1.0)]


def test_a_table_is_named_after_its_cell(tmp_path: Path) -> None:
    cells = [open_cell(store_cell(tmp_path, seed=3)), open_cell(store_cell(tmp_path, variant=Variant.of(cutout=0.4)))]
    names = ["push-gnn_ppo-seed-03.csv", "push-gnn_ppo-cutout-0.40-seed-00.csv"]
    assert [path_of(tmp_path, cell.record) for cell in cells] == [tmp_path / "headroom" / name for name in names]


def test_rows_of_another_policy_or_version_are_not_a_cells_own(tmp_path: Path) -> None:
    record = open_cell(store_cell(tmp_path)).record
    assert of_cell(tmp_path, record, "sha256:1") is None
    rows = [row_of(0, policy="sha256:1"), row_of(1, policy="sha256:1", task_version=2), row_of(2, policy="sha256:2")]
    store_table(path_of(tmp_path, record), HEADROOM, *rows)
    found = of_cell(tmp_path, record, "sha256:1")
    assert found is not None
    assert found["instance"].tolist() == [0]


def test_a_damaged_table_is_named_and_stays(tmp_path: Path) -> None:
    path = store_table(tmp_path / "headroom" / "push-gnn_ppo-seed-00.csv", HEADROOM, row_of(0, best_success=2))
    (tmp_path / "codesign-bench.json").write_text("{}")
    before = path.read_bytes()
    with pytest.raises(UnusableFile, match=path.name):
        add_rows(tmp_path, path, [row_of(1)])
    assert path.read_bytes() == before


def test_another_process_that_never_ends_writing_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(headroom, "LOCK_SECONDS", 0.0)
    path = tmp_path / "headroom" / "push-gnn_ppo-seed-00.csv"
    add_rows(tmp_path, path, [row_of(0)])
    with filelock.FileLock(path.parent / LOCK_FILE), pytest.raises(UserError, match="another process holds the lock"):
        add_rows(tmp_path, path, [row_of(1)])


def test_rows_come_with_the_best_known_of_their_instance(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="codesign-bench headroom --policy CELL"):
        load_headroom(tmp_path)
    store_table(tmp_path / "headroom" / "one.csv", HEADROOM, row_of(0), row_of(1))
    store_table(tmp_path / "headroom" / "two.csv", HEADROOM, row_of(1, task_version=2))
    assert load_headroom(tmp_path)["known_return"].isna().tolist() == [True] * 3
    points = [
        {"task": "push", "point": point, "instance": instance, "return": value + instance}
        for point, value in (("best_known", 5.0), ("idle", 0.0))
        for instance in (0, 1)
    ]
    store_table(tmp_path / INSTANCES_FILE, REFERENCE_INSTANCES, *points)
    found = load_headroom(tmp_path)
    assert found["known_return"].fillna(-1.0).tolist() == [5.0, 6.0, -1.0], "of the second version nothing is known"
