"""Everything in a results folder that cannot be used is named with its reason, and nothing else."""

from __future__ import annotations

from pathlib import Path

from builders import rising, store_cell, store_table
from codesign_bench.storage.measurements import DESIGN_SENSITIVITY, OUTSIDE_REGION
from codesign_bench.storage.survey import lines, survey


def test_nothing_is_said_of_a_folder_in_which_all_is_well(tmp_path: Path) -> None:
    store_cell(tmp_path, curve=rising(1.0, 2.0))
    store_table(tmp_path / "design_sensitivity" / "push.csv", DESIGN_SENSITIVITY, {"task": "push"})
    (tmp_path / "notes.txt").write_text("mine")
    assert survey(tmp_path) == []
    assert survey(tmp_path / "nowhere") == []


def test_cells_their_files_and_tables_beside_them_are_named(tmp_path: Path) -> None:
    (store_cell(tmp_path, seed=0) / "cell.json").write_text("{")
    (store_cell(tmp_path, seed=1) / "curve.csv").unlink()
    store_table(tmp_path / "design_sensitivity" / "push.csv", DESIGN_SENSITIVITY, {"task": "push"})
    store_table(tmp_path / "design_sensitivity" / "scoop.csv", DESIGN_SENSITIVITY, {"task": "scoop", "tool": -1})
    store_table(tmp_path / "outside_region" / "push-gnn_ppo.csv", OUTSIDE_REGION, {"return": "much"})
    (tmp_path / "reference_points.csv").symlink_to("nowhere")
    (tmp_path / "cutout_regions").write_text("")
    cells = "push/gnn_ppo/default"
    told = lines(tmp_path, survey(tmp_path))
    assert [line.split(":")[0] for line in told] == [
        f"{cells}/seed-00/cell.json",
        f"{cells}/seed-01/curve.csv",
        "reference_points.csv",
        "design_sensitivity/scoop.csv",
        "outside_region/push-gnn_ppo.csv",
        "cutout_regions",
    ]
    assert told[1].endswith(": it is missing, although the cell is done")
