"""Packing takes what is finished and whole, says what it leaves out and why, and replaces nothing."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from builders import VERSION_0_1_0, rising, store_cell, store_table
from codesign_bench.cell.variant import Variant
from codesign_bench.errors import UserError
from codesign_bench.sharing.pack import Order, pack, spent_on_tuning
from codesign_bench.storage.archive import check_archive, unpack
from codesign_bench.storage.best_known import BestKnown, Episode, load_best_known, store
from codesign_bench.storage.frames import load_results
from codesign_bench.storage.measurements import DESIGN_SENSITIVITY, REFERENCE_POINTS
from codesign_bench.storage.records import RUNNING
from toy import ToyReach

CODE: Mapping[str, Any] = {"version": "0.2.0", "commit": "a" * 40, "changed": False, "fingerprint": "f"}


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    """Return a folder with two finished cells, a running and a damaged one, and tables."""
    folder = tmp_path / "runs"
    for seed in range(2):
        store_cell(folder, seed=seed, curve=rising(0.0, 1.0), code=CODE, versions={"numpy": f"2.{seed}"})
    store_cell(folder, seed=2, status=RUNNING)
    (store_cell(folder, seed=3) / "curve.csv").unlink()
    store_cell(folder, variant=Variant.of(alpha=0.3))
    store_table(folder / "reference_points.csv", REFERENCE_POINTS, {"task": "push", "point": "idle"})
    store_table(folder / "design_sensitivity" / "push.csv", DESIGN_SENSITIVITY, {"task": "push"})
    return folder


def test_an_archive_describes_itself(runs: Path, tmp_path: Path) -> None:
    out, printed = tmp_path / "mine.zip", list[str]()
    order = Order(by="me", note="a note", tuning=["by hand", "12000"])
    manifest = pack(runs, out, order, printed.append)
    assert manifest == check_archive(out)
    assert (manifest.title, manifest.by, manifest.note, manifest.cells) == ("runs", "me", "a note", 3)
    assert manifest.code[0] == {**CODE, "cells": 2}
    assert manifest.versions["numpy"] == {"2.0": 1, "2.1": 1, "not installed": 1}
    assert manifest.packed_by["version"]
    assert manifest.tuning_note == "by hand; 12,000 steps"
    assert {"reference_points.csv", "design_sensitivity/push.csv"} <= set(manifest.files)
    assert printed == [
        "left out: push/gnn_ppo/default/seed-03/curve.csv: it is missing, although the cell is done",
        "left out: push/gnn_ppo/default/seed-02: it is interrupted",
    ]
    assert sorted(load_results(out)["seed"].unique()) == [0, 1]


def test_best_known_episodes_keep_their_plans(tmp_path: Path) -> None:
    runs, task, known = tmp_path / "runs", ToyReach(), BestKnown()
    store_cell(runs, curve=rising(0.0, 1.0))
    known.offer(Episode(0, 2.0, True, 5, "a cell", np.linspace(0.0, 1.0, 6, dtype=np.float32)))
    store(runs, task, known)
    pack(runs, tmp_path / "mine.zip", Order(), lambda line: None)
    unpack(tmp_path / "mine.zip", tmp_path / "back")
    best = load_best_known(tmp_path / "back", task).best(0)
    assert best is not None
    np.testing.assert_array_equal(best.plan, np.linspace(0.0, 1.0, 6, dtype=np.float32))


def test_a_brief_archive_has_what_the_leaderboard_needs(tmp_path: Path) -> None:
    runs = tmp_path / "runs"
    shutil.copytree(VERSION_0_1_0, runs)
    whole = pack(runs, tmp_path / "whole.zip", Order(), lambda line: None)
    brief = pack(runs, tmp_path / "brief.zip", Order(brief=True), lambda line: None)
    assert whole.policies > 0
    assert brief.policies == 0
    assert {name.split("/")[-1] for name in brief.files if "/" in name} == {"cell.json", "curve.csv", "evaluation.csv"}
    assert {name.split("/")[2] for name in brief.files if "/" in name} == {"default"}
    assert 0 < brief.cells < whole.cells


def test_no_file_is_replaced(runs: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.zip").write_text("precious")
    with pytest.raises(UserError, match="no archive is replaced"):
        pack(runs, tmp_path / "mine.zip", Order(), lambda line: None)
    assert (tmp_path / "mine.zip").read_text() == "precious"


def test_bad_input_is_one_line_and_leaves_nothing(runs: Path, tmp_path: Path) -> None:
    store_cell(tmp_path / "other", status=RUNNING)
    for results, out, order, word in (
        (runs, "mine.tar", Order(), "zip"),
        (runs, "mine.zip", Order(by="x" * 3000), "--by"),
        (runs, "mine.zip", Order(tuning=["x" * 3000]), "--tuning"),
        (runs, "mine.zip", Order(tuning=[str(tmp_path)]), "--tuning"),
        (tmp_path / "other", "mine.zip", Order(), "no finished cell"),
        (tmp_path / "nowhere", "mine.zip", Order(), "nowhere"),
    ):
        with pytest.raises(UserError, match=word):
            pack(results, tmp_path / out, order, lambda line: None)
    assert {path.name for path in tmp_path.iterdir()} == {"runs", "other"}


def test_the_steps_of_a_search_are_counted_by_task_and_method(tmp_path: Path) -> None:
    for seed in range(2):
        store_cell(tmp_path, seed=seed, env_steps=1000, variant=Variant.of(alpha=0.3))
    store_cell(tmp_path, task="scoop", method="cma_es", env_steps=7)
    assert spent_on_tuning([str(tmp_path)]) == ({"push": {"gnn_ppo": 2000}, "scoop": {"cma_es": 7}}, "")
