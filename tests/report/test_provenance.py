"""How results were made: settings with their sources, code, machines and versions."""

from __future__ import annotations

from pathlib import Path

from codesign_bench.config.settings import Sourced
from codesign_bench.report.cells import read_cells
from codesign_bench.report.provenance import code_table, configurations, machine_table, version_table
from reports import config, make_cell


def test_settings_that_differ_between_cells_get_a_line_for_each_value(tmp_path: Path) -> None:
    make_cell(tmp_path, 0)
    make_cell(tmp_path, 1)
    tuned = config(8, "tuned", clip=Sourced(0.2, "default"))
    make_cell(tmp_path, 0, task="weave", config=tuned, versions={"python": "3.11.7", "torch": None})
    make_cell(tmp_path, 1, task="weave", config=tuned, versions={"python": "3.11.7"})
    cells, _ = read_cells(tmp_path)
    (configuration,) = configurations(cells)
    assert list(configuration.table.rows) == [
        ("steps", "1000", "default", "all"),
        ("epochs", "4", "default", "reach"),
        ("epochs", "8", "tuned", "weave"),
        ("clip", "0.2", "default", "weave"),
    ]
    rows = version_table(cells).rows
    assert ("torch", "not installed", "weave/gnn_ppo/default/seed-00") in rows
    assert ("torch", "not recorded", "weave/gnn_ppo/default/seed-01") in rows
    assert any(row[:2] == ("task weave", "1") for row in rows)


def test_cells_that_nothing_but_their_seed_tells_apart_are_named(tmp_path: Path) -> None:
    for seed, epochs in enumerate((4, 4, 4, 8)):
        make_cell(tmp_path, seed, config=config(epochs))
    (configuration,) = configurations(read_cells(tmp_path)[0])
    assert [row[3] for row in configuration.table.rows] == [
        "all",
        "reach/gnn_ppo/default/seed-00, reach/gnn_ppo/default/seed-01 and 1 more",
        "reach/gnn_ppo/default/seed-03",
    ]


def test_commits_are_told_with_their_cells(tmp_path: Path) -> None:
    told = {"version": "0.2.0", "commit": "a" * 40, "changed": False, "fingerprint": "1" * 64}
    make_cell(tmp_path, 0, code=told, versions={"codesign_bench": "0.2.0"})
    make_cell(tmp_path, 0, task="weave", versions={"codesign_bench": "0.1.0"})
    assert list(code_table(read_cells(tmp_path)[0]).rows) == [
        ("0.2.0", "aaaaaaaaaaaa", "reach"),
        ("0.1.0", "not recorded", "weave"),
    ]


def test_a_machine_is_told_with_its_instruction_sets(tmp_path: Path) -> None:
    make_cell(tmp_path, 0, host={"name": "desk", "cpu": "some CPU", "instruction_sets": ["avx2"], "threads": 1})
    ((*told, count),) = machine_table(read_cells(tmp_path)[0]).rows
    assert "some CPU (avx2)" in told
    assert count == "1"
