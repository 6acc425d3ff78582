"""`codesign-bench headroom`: tools are tried once, episodes are renewed, and bad input is named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from builders import store_played_cell
from codesign_bench.cli import main
from codesign_bench.evaluation.reference_points import measure_missing
from codesign_bench.storage.measurements import BEST_KNOWN_EPISODES
from codesign_bench.storage.reference_points import BEST_KNOWN, load_reference_points
from codesign_bench.storage.tables import read_table

pytestmark = pytest.mark.usefixtures("toy")

SMALL = ("--candidates", "12", "--popsize", "6")


@pytest.fixture
def cell(toy: None, tmp_path: Path) -> Path:
    """A finished toy cell in a folder of its own."""
    return store_played_cell(tmp_path / "cells", "toy_reach", "toy_search", {"vector": np.array([0.3, 0.2])})


def test_tools_are_tried_once_and_the_means_shown_every_time(
    cell: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = ["headroom", "--policy", str(cell), "--results", str(tmp_path / "runs"), *SMALL, "--random-tools", "2"]
    assert main(line) == 0
    first, *table = capsys.readouterr().out.splitlines()
    assert first.startswith("trying other tools on 8 instances of toy_reach/toy_search/default/seed-00")
    assert [text.strip() for text in table[2].split("|")[1:3]] == ["toy_reach-toy_search-seed-00", "8"]
    assert main(line) == 0
    assert capsys.readouterr().out.splitlines() == table
    stored = pd.read_csv(tmp_path / "runs" / "headroom" / "toy_reach-toy_search-seed-00.csv")
    assert set(stored["candidates"]) == {12}
    assert set(stored["sigma0"]) == {0.3}


def test_episodes_are_renewed_and_reference_points_with_them(
    cell: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = tmp_path / "runs"
    line = ["headroom", "--policy", str(cell), "--update", "--results", str(results), *SMALL]
    assert main(line) == 0
    printed = capsys.readouterr().out
    assert "toy_reach: 8 instances improved" in printed
    assert "measure them with: codesign-bench reference --task toy_reach" in printed
    episodes = read_table(results / "best_known" / "toy_reach.csv", BEST_KNOWN_EPISODES.form)
    assert episodes is not None
    best = episodes.groupby("instance")["return"].max().mean()
    measure_missing(results, ["toy_reach"], [].append)
    point = load_reference_points(results).set_index("point").loc[BEST_KNOWN]
    assert point["return_mean"] >= best, "it counts stored episodes"
    assert main([*line, "--candidates", "60"]) == 2, "headroom was measured with another budget"
    capsys.readouterr()
    assert main(["headroom", "--update", "--task", "toy_reach", "--results", str(results), "--candidates", "60"]) == 0
    assert "no reference points" not in capsys.readouterr().out
    renewed = load_reference_points(results).set_index("point").loc[BEST_KNOWN]
    assert renewed["return_mean"] >= point["return_mean"]
    assert "stored episodes" in str(renewed["source"])


def test_a_dry_run_says_how_much_would_be_played_and_plays_nothing(
    cell: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = tmp_path / "runs"
    line = ["headroom", "--policy", str(cell), "--update", "--results", str(results), *SMALL, "--random-tools", "2"]
    assert main([*line, "--dry-run"]) == 0
    of_cell, of_task, last = capsys.readouterr().out.splitlines()
    assert of_cell.startswith(f"{cell}: at most {8 * (8 + 2 + 12)} episodes, ")
    assert of_task.startswith(f"toy_reach: at most {8 * (2 + 4) + 8 * (1 + 7 + 12 + 2)} episodes, ")
    assert last == "nothing was played"
    assert not results.exists()


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ([], "--policy CELL, --update, or both"),
        (["--policy", "nowhere"], "'nowhere' is not a cell folder"),
        (["--policy", "nowhere", "--task", "toy_reach"], "--task needs --update"),
        (["--update"], "name a task with --task"),
        (["--update", "--task", "pull"], "toy_reach"),
        (["--update", "--random-tools", "3"], "--random-tools needs --policy"),
        (["--update", "--popsize", "1"], "--popsize"),
        (["--update", "--sigma0", "0"], "--sigma0"),
        (["--update", "--candidates", "-1"], "--candidates"),
        (["--update", "--instances", "0"], "--instances"),
    ],
)
def test_bad_input_is_named(
    arguments: list[str], named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["headroom", *arguments, "--results", str(tmp_path / "runs")]) == 2
    message = capsys.readouterr().err
    assert named in message
    assert len(message.strip().splitlines()) <= 2
    assert not (tmp_path / "runs").exists()
