"""Results that version 0.1.0 wrote are read by this one: a frozen folder of them goes through every command."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from builders import VERSION_0_1_0
from codesign_bench import load_results, load_task
from codesign_bench.cli import main
from codesign_bench.storage.cells import find_cells
from codesign_bench.storage.frames import load_evaluations, rows_varying
from codesign_bench.storage.layout import EVALUATION_FILE
from played_alike import assert_plays_as_stored

SETTINGS = "batch_size=600 minibatch_size=150 epochs=2 design_epochs=2 popsize=4 episodes_per_candidate=1"
SETTINGS += " policy_net=16,16 value_net=16,16 control_gnn=16,16 control_index_mlp=16 design_gnn=16,16"
SETTINGS += " design_index_mlp=16 value_mlp=16 evaluations=2 design_credit=separate cma_es.sigma0=0.3"
"""With which the folder was made, by 1,200 steps of the profile `quick`."""
GNN_PPO = "batch_size=600 minibatch_size=150 epochs=2 design_epochs=2 control_gnn=16,16 control_index_mlp=16"
GNN_PPO += " design_gnn=16,16 design_index_mlp=16 value_mlp=16 evaluations=2 design_credit=separate"
MADE_BY = [
    ("gnn_ppo cma_rl cma_es", "push", "--seeds 2", SETTINGS),
    ("gnn_ppo", "fetch_cube", "--seeds 1", GNN_PPO),
    ("gnn_ppo", "fetch_cube", "--seeds 1 --cutout 0.4", GNN_PPO),
    ("gnn_ppo", "lift_cup", "--seeds 1", GNN_PPO),
    ("gnn_ppo", "catch_balls", "--seeds 1 --alpha 0.125", GNN_PPO),
]
"""Methods, task, seeds and variant, settings; besides, `--finetune 1 --scratch 1` on fetch_cube."""


def has_changed(task: str) -> bool:
    """Return whether a task is at another version than the one that this folder was made on."""
    return load_task(task).version != 1


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """Return a copy of the folder."""
    return Path(shutil.copytree(VERSION_0_1_0, tmp_path / "runs"))


def contents(folder: Path) -> dict[str, bytes]:
    """Return every file below a folder."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_every_cell_is_found_with_its_status_and_what_it_varies() -> None:
    cells = {cell.record.variant.name: cell for cell in find_cells(VERSION_0_1_0)}
    assert set(cells) == {"default", "cutout-0.40", "alpha-0.125", "finetune-1", "scratch-1"}
    assert cells["alpha-0.125"].record.variant.get("alpha") == 0.125
    assert all(cell.folder.parent.name == cell.record.variant.name for cell in cells.values())
    found = [cell.status for cell in find_cells(VERSION_0_1_0)]
    assert {status: found.count(status) for status in found} == {"done": 12, "interrupted": 1, "failed": 1}


def test_frames_have_every_axis_as_a_column() -> None:
    for frame in (load_results(VERSION_0_1_0), load_evaluations(VERSION_0_1_0)):
        assert rows_varying(frame, "alpha")["alpha"].unique().tolist() == [0.125]
        assert rows_varying(frame, "cutout")["variant"].unique().tolist() == ["cutout-0.40"]
        assert rows_varying(frame, "finetune")["finetune"].unique().tolist() == [1.0]
        assert set(frame["label"]) >= {"GNN-PPO, separate credit", "CMA-RL", "CMA-ES"}


@pytest.mark.numeric
@pytest.mark.parametrize("cell", ["push/gnn_ppo", "push/cma_rl", "push/cma_es", "fetch_cube/gnn_ppo"])
def test_a_policy_does_what_its_curve_says(cell: str) -> None:
    folder = VERSION_0_1_0 / cell / "default" / "seed-00"
    (told,) = (found for found in find_cells(VERSION_0_1_0) if found.folder == folder)
    assert_plays_as_stored(told, episodes=32)
    assert pd.read_csv(folder / EVALUATION_FILE)["return"].mean() == pytest.approx(
        told.last_evaluation()["return_mean"]
    )


def test_fine_tuning_on_one_instance_is_refused_and_left_alone(
    results: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = contents(results)
    line = f"run --method gnn_ppo --task fetch_cube --seeds 1 --finetune 1 --scratch 1 --profile quick --set {GNN_PPO}"
    assert main([*line.split(), "--out", str(results)]) == 2
    assert "fine_tuning_instances: stored 1, requested 8" in capsys.readouterr().err
    assert contents(results) == before


@pytest.mark.parametrize(("methods", "task", "grid", "settings"), [row for row in MADE_BY if has_changed(row[1])])
def test_finished_cells_of_a_task_that_has_changed_are_refused_and_left_alone(
    methods: str, task: str, grid: str, settings: str, results: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = contents(results)
    line = f"run --method {methods} --task {task} {grid} --steps 1200 --profile quick --set {settings} --out {results}"
    assert main(line.split()) == 2
    assert f"version of task '{task}': stored 1" in capsys.readouterr().err
    assert contents(results) == before


@pytest.mark.parametrize(("methods", "task", "grid", "settings"), [row for row in MADE_BY if not has_changed(row[1])])
def test_finished_cells_count_as_done_and_are_left_alone(
    methods: str, task: str, grid: str, settings: str, results: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = contents(results)
    line = f"run --method {methods} --task {task} {grid} --steps 1200 --profile quick --set {settings} --out {results}"
    assert main(line.split()) == 0
    first = capsys.readouterr().out.splitlines()[0]
    assert first.split()[0] == first.split()[2]  # "6 cells, 6 of them already done"
    assert contents(results) == before


def test_every_command_reads_it(results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before, out = contents(results), tmp_path / "out"
    policy = str(results / "fetch_cube" / "gnn_ppo" / "default" / "seed-00")
    for command in (
        ["status", "--results", str(results)],
        ["plot", "learning_curves", "qualitative_tools", "--results", str(results), "--out", str(out / "figures")],
        ["verify", "--results", str(results), "--out", str(out / "claims")],
        ["render", "--policy", policy, "--episodes", "1", "--out", str(out / "fetch_cube.png")],
        ["export", "--policy", policy, "--instances", "0", "--out", str(out / "tools")],
        ["deploy", "--policy", policy, "--tool", "1", "--no-gifs", "--out", str(out / "deployment")],
    ):
        assert main(command) == 0, capsys.readouterr().err
    names = {path.name for path in out.rglob("*")}
    assert names >= {"learning_curves.png", "qualitative_tools.csv", "claims.json", "fetch_cube.png"}
    assert contents(results) == before


@pytest.mark.slow
def test_the_report_draws_every_figure_of_it(results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before, page = contents(results), tmp_path / "report.html"
    assert main(["report", "--results", str(results), "--out", str(page)]) == 0, capsys.readouterr().err
    assert "1 failed, 1 interrupted" in page.read_text()
    assert contents(results) == before


def test_numbers_survive_to_the_last_digit() -> None:
    frame = load_results(VERSION_0_1_0)
    text = (VERSION_0_1_0 / "push" / "cma_es" / "default" / "seed-01" / "curve.csv").read_text().splitlines()
    told = dict(zip(text[0].split(","), text[-1].split(","), strict=True))
    last = frame[(frame["method"] == "cma_es") & (frame["seed"] == 1)].iloc[-1]
    assert np.array_equal([float(told[name]) for name in told], last[list(told)].astype(float))
