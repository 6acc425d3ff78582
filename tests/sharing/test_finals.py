"""Final values: finished cells, whole and reported, in the order of tasks and methods."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from builders import rising, store_cell
from codesign_bench.cell.variant import Variant
from codesign_bench.sharing.finals import finals_of
from codesign_bench.stats import Reference
from codesign_bench.storage.records import RUNNING


def test_finals_are_the_ends_of_finished_cells(tmp_path: Path) -> None:
    for seed, end in enumerate((1.0, 3.0)):
        store_cell(tmp_path, task="scoop", method="cma_es", seed=seed, curve=rising(0.0, end), env_steps=100 + seed)
    store_cell(tmp_path, task="scoop", method="cma_es", seed=2, status=RUNNING, curve=rising(0.0, 9.0))
    damaged = store_cell(tmp_path, task="scoop", method="cma_es", seed=3, curve=rising(0.0, 9.0))
    (damaged / "curve.csv").write_text("env_steps\n1\n")
    store_cell(tmp_path, task="push", method="gnn_ppo", label="GNN", variant=Variant.of(alpha=0.3))
    push, scoop = finals_of(tmp_path)
    assert (push.scene, push.variant, push.method, push.label) == (("push", 1), "alpha-0.30", "gnn_ppo", "GNN")
    assert scoop.returns.tolist() == [1.0, 3.0]
    assert scoop.env_steps == 100.5


def test_scores_are_on_the_scale_of_the_same_scene_and_reward(tmp_path: Path) -> None:
    store_cell(tmp_path, curve=rising(0.0, 3.0))
    store_cell(tmp_path, seed=1, task_version=2, curve=rising(0.0, 3.0))
    store_cell(tmp_path, variant=Variant.of(alpha=0.3), curve=rising(0.0, 3.0))
    newer, other_reward, plain = finals_of(tmp_path)
    scales = {("push", 1): Reference(1.0, 5.0)}
    assert plain.scores(scales) == pytest.approx([0.5])
    assert newer.scene == ("push", 2)
    assert np.isnan(newer.scores(scales)).all()
    assert np.isnan(other_reward.scores(scales)).all()
