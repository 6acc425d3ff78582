"""A stored cell runs again with the configuration in its record, and with the same curve."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from builders import sweep, toy_cells
from codesign_bench.cell.variant import Variant
from codesign_bench.errors import UserError
from codesign_bench.storage.cells import open_cell
from codesign_bench.storage.layout import CURVE_FILE
from codesign_bench.storage.records import CELL_FILE
from codesign_bench.sweep.rerun import cell_of, rerun

pytestmark = pytest.mark.usefixtures("toy")
TUNED = ("evaluations=4", "step_size=0.123456789", "toy_search.episodes=5")


def again(folder: Path, out: Path, **options: bool) -> tuple[int, list[str]]:
    """Run a stored cell again; return the exit code and the lines that were printed."""
    console = Console(record=True, width=200, file=io.StringIO())
    code = rerun(folder, out, console=console, **options)
    return code, console.export_text().splitlines()


def test_a_cell_of_other_settings_runs_again_as_it_was(tmp_path: Path) -> None:
    (cell,) = toy_cells(overrides=TUNED)
    assert sweep([cell], tmp_path / "runs")[0] == 0
    folder = cell.folder(tmp_path / "runs")
    assert cell_of(open_cell(folder)).overrides == (
        "run.evaluations=4",
        "toy_search.episodes=5",
        "toy_search.step_size=0.123456789",
    )
    code, lines = again(folder / CELL_FILE, tmp_path / "again")
    assert code == 0
    assert lines[-1] == "the same curve as before, digit for digit, in all of its 5 rows"
    stored, new = (open_cell(cell.folder(tmp_path / name)).record for name in ("runs", "again"))
    assert {name: entry.value for name, entry in stored.config.method.items()} == {
        name: entry.value for name, entry in new.config.method.items()
    }


def test_where_a_curve_parts_is_told_with_what_was_different(tmp_path: Path) -> None:
    (cell,) = toy_cells()
    assert sweep([cell], tmp_path / "runs")[0] == 0
    folder = cell.folder(tmp_path / "runs")
    record = open_cell(folder).record
    rows = (folder / CURVE_FILE).read_text().splitlines()
    fields = rows[2].split(",")
    fields[2] = "12.5"
    (folder / CURVE_FILE).write_text("\n".join([*rows[:2], ",".join(fields), *rows[3:]]) + "\n")
    replace(record, checksums={}, versions={**record.versions, "numpy": "1.0"}).write(folder)
    code, lines = again(folder, tmp_path / "again")
    assert code == 0
    assert any(line.startswith("the curve differs from before, from row 2 of 5 on: return_mean 12.5") for line in lines)
    assert lines[-1].startswith("libraries: numpy")


def test_a_cell_that_starts_from_another_has_that_run_again_first(tmp_path: Path) -> None:
    (before,) = toy_cells()
    fine = replace(before, variant=Variant.of(finetune=1), steps=100)
    assert sweep([before], tmp_path / "runs")[0] == 0
    assert sweep([fine], tmp_path / "runs")[0] == 0
    code, lines = again(fine.folder(tmp_path / "runs"), tmp_path / "again")
    assert code == 0
    assert [line.startswith("the same curve as before") for line in lines[-2:]] == [True, True]
    assert open_cell(before.folder(tmp_path / "again")).is_done


def test_a_setting_that_is_gone_is_refused_by_name(tmp_path: Path) -> None:
    (cell,) = toy_cells()
    assert sweep([cell], tmp_path / "runs")[0] == 0
    path = cell.folder(tmp_path / "runs") / CELL_FILE
    content = json.loads(path.read_text())
    content["config"]["method"]["gone"] = {"value": 3, "source": "default"}
    path.write_text(json.dumps(content))
    with pytest.raises(UserError, match="gone: stored 3, requested absent"):
        again(path, tmp_path / "again")
    assert not (tmp_path / "again").exists()


def test_it_does_not_run_again_in_its_own_folder(tmp_path: Path) -> None:
    (cell,) = toy_cells()
    assert sweep([cell], tmp_path / "runs")[0] == 0
    with pytest.raises(UserError, match="holds the cell itself"):
        again(cell.folder(tmp_path / "runs"), tmp_path / "runs")
