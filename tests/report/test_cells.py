"""Cells as the page counts and names them."""

from __future__ import annotations

import json
from pathlib import Path

from codesign_bench.config.settings import Sourced, StoredConfig
from codesign_bench.report.cells import read_cells
from codesign_bench.storage.records import CELL_FILE
from reports import Reader, config, make_cell


def test_cells_are_counted_by_status_and_damaged_ones_named(page: str) -> None:
    text = Reader(page).text
    assert "5: 3 done, 1 failed, 1 interrupted" in text
    assert (
        "reach/gnn_ppo/default/seed-05/cell.json: Expecting property name"
        in text.split("Left out")[1].split("every cell")[0]
    )


def test_a_cell_file_without_the_usual_parts_is_named_as_unreadable(tmp_path: Path) -> None:
    make_cell(tmp_path, 0)
    for seed, damage in enumerate(
        ({"config": {}}, {"config": {"run": {"steps": 5}, "method": {}}}, {"host": "desk"}), 1
    ):
        path = make_cell(tmp_path, seed) / CELL_FILE
        path.write_text(json.dumps({**json.loads(path.read_text()), **damage}))
    cells, damaged = read_cells(tmp_path)
    assert [cell.name[-7:] for cell in cells] == ["seed-00"]
    assert [line.split(": ")[0][-17:] for line in damaged] == [f"seed-0{seed}/cell.json" for seed in (1, 2, 3)]


def test_cells_of_tuning_are_neither_shown_nor_called_unreadable(tmp_path: Path) -> None:
    make_cell(tmp_path, 0)
    run = {**config().run, "instances": Sourced("validation", "variant")}
    make_cell(tmp_path, 1, config=StoredConfig(run, config().method))
    cells, damaged = read_cells(tmp_path)
    assert [cell.name[-7:] for cell in cells] == ["seed-00"]
    assert damaged == []
