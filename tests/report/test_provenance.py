"""How results were made: settings with their sources, versions, and the commit of the code."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

import codesign_bench
from codesign_bench.config.settings import Sourced
from codesign_bench.report.cells import read_cells
from codesign_bench.report.provenance import code_version, configurations, version_table
from reports import config, make_cell


def test_settings_that_differ_between_cells_get_a_line_for_each_value(tmp_path: Path) -> None:
    make_cell(tmp_path, 0)
    make_cell(tmp_path, 1)
    tuned = config(8, "tuned", clip=Sourced(0.2, "default"))
    make_cell(tmp_path, 0, task="weave", config=tuned, versions={"python": "3.11.7"})
    cells, _ = read_cells(tmp_path)
    (configuration,) = configurations(cells)
    assert list(configuration.table.rows) == [
        ("steps", "1000", "default", "all"),
        ("epochs", "4", "default", "reach"),
        ("epochs", "8", "tuned", "weave"),
        ("clip", "0.2", "default", "weave"),
    ]
    assert ("torch", "not installed", "weave") in version_table(cells).rows
    assert ("task weave", "1", "weave") in version_table(cells).rows


def test_cells_that_nothing_but_their_seed_tells_apart_are_named(tmp_path: Path) -> None:
    for seed, epochs in enumerate((4, 4, 4, 8)):
        make_cell(tmp_path, seed, config=config(epochs))
    (configuration,) = configurations(read_cells(tmp_path)[0])
    assert [row[3] for row in configuration.table.rows] == [
        "all",
        "reach/gnn_ppo/default/seed-00, reach/gnn_ppo/default/seed-01 and 1 more",
        "reach/gnn_ppo/default/seed-03",
    ]


def git(folder: Path, *arguments: str) -> None:
    """Run git in `folder` as somebody."""
    somebody = ("-c", "user.name=a", "-c", "user.email=a@example.com")
    subprocess.run(["git", *somebody, *arguments], cwd=folder, check=True, capture_output=True)


@pytest.mark.skipif(shutil.which("git") is None, reason="needs git")
def test_the_commit_is_told_where_the_code_is_a_checkout_and_nowhere_else(tmp_path: Path) -> None:
    package = tmp_path / "package"
    package.mkdir()
    (package / "__init__.py").write_text("")
    version = f"codesign-bench {codesign_bench.__version__}"
    git(tmp_path, "init")
    assert code_version(package) == version  # another project's checkout, with the package in its environment
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "--message", "one")
    assert code_version(package).startswith(f"{version}, commit ")
    assert "uncommitted changes" not in code_version(package)
    (package / "__init__.py").write_text("changed = True\n")
    assert code_version(package).endswith("uncommitted changes")
