"""A whole search by the command: its winner, its size, what it leaves for reports, and that a kill loses nothing."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from rich.console import Console
from toy_failing import LONGEST
from toy_tuning import return_by_hand

from codesign_bench import load_results
from codesign_bench.cli import main
from codesign_bench.errors import UserError
from codesign_bench.plugins import import_modules
from codesign_bench.registry import IMPORTS_VARIABLE
from codesign_bench.storage.frames import load_evaluations
from codesign_bench.storage.locks import is_locked
from codesign_bench.study import Study, Tuning
from codesign_bench.tuning.results import read_winners
from codesign_bench.tuning.tune import budgets_of, tune, tuning_of
from toy import ToyReach

pytestmark = pytest.mark.usefixtures("toy")

TESTS = Path(__file__).resolve().parents[1]
TUNE = ("tune", "--import", "toy", "--import", "toy_tuning", "--study", "toy_tuning", "--steps", "300")
CELLS = 2 * (3 + 1)
"""Of both methods: three settings, of which one goes on, with one seed each."""
PATIENCE_SECONDS = 120.0


def records(out: Path) -> dict[str, str]:
    """Return the records of all finished cells by their path."""
    found = {path: path.read_text() for path in out.glob("*/*/*/*/cell.json")}
    return {str(path.relative_to(out)): text for path, text in found.items() if json.loads(text)["status"] == "done"}


def table(out: Path) -> pd.DataFrame:
    return pd.read_csv(out / "tuning.csv")


def start(*arguments: str | Path) -> subprocess.Popen[str]:
    """Start a search as a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(TESTS), IMPORTS_VARIABLE: ""}
    line = [sys.executable, "-m", "codesign_bench", *TUNE, *map(str, arguments)]
    return subprocess.Popen(line, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def finish(process: subprocess.Popen[str]) -> str:
    """Return what a search printed."""
    printed, _ = process.communicate(timeout=PATIENCE_SECONDS)
    assert process.returncode == 0, printed
    return printed


def wait_for(condition: Callable[[], bool]) -> None:
    """Wait until it holds."""
    deadline = time.monotonic() + PATIENCE_SECONDS
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)


@pytest.fixture(scope="module")
def searched(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Return the folder of an undisturbed search, and what it printed."""
    out = tmp_path_factory.mktemp("searched")
    return out, finish(start("--out", out))


def best_length(out: Path) -> float:
    """Return the length with the highest validation return in the first rung."""
    rows = table(out)
    first = rows[(rows["method"] == "toy_aim") & (rows["rung"] == 0)]
    return float(first.loc[first["validation_return"].idxmax(), "length"])


def test_returns_are_those_on_validation_instances_and_the_best_length_wins(searched: tuple[Path, str]) -> None:
    out, printed = searched
    rows = table(out)
    aim = rows[rows["method"] == "toy_aim"]
    expected = [return_by_hand(length, ToyReach().validation_instances()) for length in aim["length"]]
    assert aim["validation_return"].tolist() == pytest.approx(expected, rel=1e-4)
    winner = f"toy_aim.length={best_length(out)}"
    assert read_winners(out / "tuned.json")["toy_reach", "toy_aim"] == (winner,)
    assert f"--set {winner}" in printed
    assert aim["kept"].sum() == 2, "one goes on, and wins the last rung"


def test_every_method_gets_as_many_settings_and_steps(searched: tuple[Path, str]) -> None:
    out, printed = searched
    sizes = table(out).groupby(["method", "rung"]).size()
    assert sizes["toy_aim"].tolist() == sizes["toy_search"].tolist() == [3, 1]
    assert table(out)["steps"].tolist() == [100] * 6 + [300] * 2
    assert "tuning of toy_aim took 600 environment steps" in printed
    spent = json.loads((out / "tuned.json").read_text())["env_steps"]
    assert spent["toy_aim"] == 3 * 100 + 300
    assert spent["toy_search"] == pytest.approx(600, rel=0.5), "whole episodes, which may pass the budget"


def test_no_result_includes_cells_of_a_search(searched: tuple[Path, str]) -> None:
    with pytest.raises(UserError, match="no results"):
        load_results(searched[0])
    with pytest.raises(UserError, match="no finished cell"):
        load_evaluations(searched[0])


def test_the_winner_is_reported_on_evaluation_instances(searched: tuple[Path, str], tmp_path: Path) -> None:
    run = ("run", "--import", "toy_tuning", "--task", "toy_reach", "--method", "toy_aim", "--steps", "10")
    tuned = searched[0] / "tuned.json"
    assert main([*run, "--seeds", "100-100", "--jobs", "1", "--tuned", str(tuned), "--out", str(tmp_path)]) == 0
    by_hand = return_by_hand(best_length(searched[0]), ToyReach().evaluation_instances())
    assert load_results(tmp_path)["return_mean"].iloc[-1] == pytest.approx(by_hand, rel=1e-4)


def test_a_kill_loses_no_finished_cell_and_the_result_is_the_same(searched: tuple[Path, str], tmp_path: Path) -> None:
    process = start("--jobs", "1", "--out", tmp_path)
    wait_for(lambda: len(records(tmp_path)) >= 3 or process.poll() is not None)
    process.kill()
    process.communicate(timeout=PATIENCE_SECONDS)
    wait_for(lambda: not any(is_locked(path.parent) for path in tmp_path.glob("*/*/*/*/cell.json")))
    before = records(tmp_path)
    assert 3 <= len(before) < CELLS
    finish(start("--out", tmp_path))
    after = records(tmp_path)
    assert len(after) == len(records(searched[0])) == CELLS
    assert {path: after[path] for path in before} == before
    for name in ("tuning.csv", "tuned.json"):
        assert (tmp_path / name).read_bytes() == (searched[0] / name).read_bytes()


def test_a_finished_search_runs_nothing_again(searched: tuple[Path, str]) -> None:
    before = records(searched[0])
    printed = finish(start("--out", searched[0]))
    assert "6 cells, 6 of them already done" in printed
    assert "2 cells, 2 of them already done" in printed
    assert records(searched[0]) == before


def test_a_search_may_be_extended_but_not_cut_down(searched: tuple[Path, str], tmp_path: Path) -> None:
    part = finish(start("--method", "toy_aim", "--out", tmp_path))
    assert "the same for toy_aim: 600 steps each" in " ".join(part.split())
    assert set(table(tmp_path)["method"]) == {"toy_aim"}
    before = records(tmp_path)
    assert "6 cells, 3 of them already done" in finish(start("--out", tmp_path))
    assert {path: records(tmp_path)[path] for path in before} == before
    tables = {name: (tmp_path / name).read_bytes() for name in ("tuning.csv", "tuned.json")}
    assert tables == {name: (searched[0] / name).read_bytes() for name in tables}
    arguments = [argument for argument in TUNE if argument != "tune"]
    assert main(["tune", *arguments, "--method", "toy_search", "--out", str(tmp_path)]) == 2
    assert tables == {name: (tmp_path / name).read_bytes() for name in tables}


def test_a_setting_that_fails_goes_no_further(tmp_path: Path) -> None:
    arguments = ("--import", "toy_failing", "--study", "toy_failing", "--steps", "30", "--out", str(tmp_path))
    assert main(["tune", *arguments]) == 1
    rows = table(tmp_path)
    first = rows[rows["rung"] == 0]
    assert first["validation_return"].isna().tolist() == (first["length"] > LONGEST).tolist()
    assert first["validation_return"].isna().any()
    kept = rows[rows["kept"] == 1]
    assert len(kept) == 2
    assert (kept["length"] <= LONGEST).all()


@pytest.mark.parametrize(("ahead_on", "replaced"), [(0, True), (1, True), (2, False)])
def test_present_settings_stay_unless_a_change_is_ahead_on_enough_tasks(
    ahead_on: int, replaced: bool, tmp_path: Path
) -> None:
    import_modules(["toy_tuning"])
    size = Tuning(methods=("toy_aim",), tasks=("toy_reach",), settings=4, rungs=1, seeds=(0,), spread=0.9, pooled=True)
    search = replace(size, ahead_on=ahead_on)
    assert tune("toy", search, profile="quick", out=tmp_path, console=Console(quiet=True), steps=50, jobs=1) == 0
    rows = table(tmp_path)
    present = rows["validation_return"][0]
    assert (rows["validation_return"] > present).any(), "some change is better"
    (kept,) = rows["setting"][rows["kept"] == 1]
    assert (kept != 0) == replaced
    assert bool(read_winners(tmp_path / "tuned.json")["toy_reach", "toy_aim"]) == replaced


def test_budgets_are_parts_of_the_profiles_or_of_the_given_one() -> None:
    tuning = Tuning(methods=("toy_search",), tasks=("toy_reach",), settings=9)
    assert budgets_of(tuning, "toy_reach", "quick", None) == [20_000, 60_000, 180_000]
    assert budgets_of(tuning, "toy_reach", "quick", 90) == [10, 30, 90]


def test_a_study_without_a_search_is_named() -> None:
    with pytest.raises(UserError, match="the study 'plain' has no tuning"):
        tuning_of(Study(name="plain", title="Plain", question="Why?"))
