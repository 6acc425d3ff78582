"""Trials are played and written as ordered."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest
from PIL import Image

from codesign_bench import load_task
from codesign_bench.deployment.conditions import TRIAL, Conditions
from codesign_bench.deployment.deploy import Order, deploy
from codesign_bench.errors import UserError


def test_a_task_without_an_arm_names_those_that_have_one(tmp_path: Path) -> None:
    task = load_task("push")
    with pytest.raises(UserError, match="task 'push' has no deployment; choose from: fetch_cube, lift_cup"):
        deploy(task, task.script(), Order(Conditions()), tmp_path, print)


def test_trials_are_written_with_their_incidents_and_a_picture_of_each(tmp_path: Path) -> None:
    task, told = load_task("fetch_cube"), list[str]()
    deploy(task, task.script(), Order(TRIAL, tools=(4,)), tmp_path, told.append, "a script")
    folder = tmp_path / "deployment" / "fetch_cube"
    table = pd.read_csv(folder / "trials.csv")
    assert table[["kind", "tool", "trial", "row", "column"]].to_numpy().tolist() == [["own", 4, 1, -1, -1]]
    assert table["instance_cube_start_x"].tolist() == [-0.211]
    assert table[["policy_seed", "solved_in_training"]].to_numpy().tolist() == [[0, 1]]
    assert table["tracking_error_mean_mm"].item() > 0.0
    assert {"unreachable_steps", "joint_limit_steps", "self_collision_steps"} <= set(table.columns)
    summary = json.loads((folder / "trials.json").read_text())
    assert summary["policy"] == "a script"
    assert summary["conditions"]["latency"] == TRIAL.latency
    assert summary["designs"]["4"]["link_1_length"] > 0.0
    assert summary["tools"][0]["trials"] == 1
    assert told[0].startswith("own-tool-4-trial-1: ")
    picture = folder / "rollouts" / "own-tool-4-trial-1.gif"
    assert picture.stat().st_size < 1_000_000
    with Image.open(picture) as film:
        assert film.n_frames > 3  # type: ignore[attr-defined]
    with pytest.raises(UserError, match="--tool 5: there is no such tool; choose from 1 to 4"):
        deploy(task, task.script(), Order(TRIAL, tools=(5,)), tmp_path, told.append)


def test_trials_are_written_all_or_none(tmp_path: Path) -> None:
    task, table = load_task("fetch_cube"), tmp_path / "deployment" / "fetch_cube" / "trials.csv"
    table.mkdir(parents=True)
    (tmp_path / "codesign-bench.json").write_text("{}")
    with pytest.raises(UserError, match=r"trials\.csv is not writable \(it is a folder\)"):
        deploy(task, task.script(), Order(Conditions(), tools=(4,)), tmp_path, print)
    assert [path for path in tmp_path.rglob("*") if path.suffix in (".gif", ".json", ".partial")] == [
        tmp_path / "codesign-bench.json"
    ]
