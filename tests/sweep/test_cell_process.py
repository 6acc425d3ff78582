"""The process of one cell: what it leaves behind, and how it ends."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from builders import sweep
from codesign_bench import load_results
from codesign_bench.cell.cell import Cell, resolve_cell
from codesign_bench.code_version import code_version
from codesign_bench.machine import host_facts, package_versions
from codesign_bench.storage.records import CellRecord
from codesign_bench.sweep.cell_process import describe

pytestmark = pytest.mark.usefixtures("toy")

CELL = Cell("toy_reach", "toy_search", seed=0, steps=200, overrides=("evaluations=4",))


def stored(cell: Cell, out: Path) -> CellRecord:
    """Return the record of a cell that has run."""
    record = CellRecord.read(cell.folder(out))
    assert record is not None
    return record


def test_a_finished_cell_holds_curve_configuration_versions_and_policy(tmp_path: Path) -> None:
    code, text = sweep([CELL], tmp_path)
    assert code == 0, text
    frame = load_results(tmp_path)
    steps = frame["env_steps"].tolist()
    assert steps[0] == 0
    assert steps[-1] >= 200
    assert len(steps) == 5
    assert frame["env_steps"].is_monotonic_increasing
    assert frame["env_steps"].is_unique
    assert set(stored(CELL, tmp_path).checksums) == {"curve.csv", "evaluation.csv"}
    assert frame["wall_s"].is_monotonic_increasing
    record = stored(CELL, tmp_path)
    assert record.status == "done"
    assert record.config.run["steps"] == (200, "--steps")
    assert record.config.method["step_size"] == (0.3, "toy paper, table 1")
    assert record.env_steps == steps[-1]
    assert dict(record.versions) == package_versions()
    assert record.code == code_version().to_json()
    assert record.host == host_facts(threads=1)
    assert record.earlier == ()
    assert str(record.timings.ended) >= str(record.timings.started)
    assert record.threads == 1
    left = {path.name for path in CELL.folder(tmp_path).iterdir()}
    assert left == {"cell.json", "curve.csv", "metrics.csv", "evaluation.csv", "policy.safetensors"}


def test_a_cell_that_is_resumed_under_other_code_keeps_what_it_began_with() -> None:
    resolved = resolve_cell(CELL)
    before = replace(describe(resolved, None), code={"fingerprint": "1f"})
    assert describe(resolved, None).earlier == ()
    resumed = describe(resolved, before)
    assert resumed.earlier == (before.conditions,)
    assert describe(resolved, resumed).earlier == resumed.earlier
    assert describe(resolved, describe(resolved, None)).earlier == ()


def test_the_cell_file_is_plain_json(tmp_path: Path) -> None:
    sweep([CELL], tmp_path)
    text = (CELL.folder(tmp_path) / "cell.json").read_text()
    assert json.dumps(json.loads(text), indent=2) + "\n" == text
