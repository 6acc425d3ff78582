"""A cell's final policy on disk."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from builders import BUDGET, VERSION_0_1_0, store_cell, sweep, toy_cells
from codesign_bench import load_policy
from codesign_bench.cell.variant import Variant
from codesign_bench.config.settings import Sourced, StoredConfig
from codesign_bench.errors import ChangedTaskError, UserError
from codesign_bench.storage.cells import open_cell
from codesign_bench.storage.policies import misfit, policy_and_task, problem_of
from codesign_bench.task import Box, load_task
from codesign_bench.task.episodes import Tradeoff
from toy import ToyReach


@pytest.mark.parametrize(("status", "named"), [("done", "policy file is missing"), ("running", "'interrupted'")])
def test_a_cell_without_a_policy_says_so(tmp_path: Path, status: str, named: str) -> None:
    with pytest.raises(UserError, match=named):
        load_policy(store_cell(tmp_path, status=status))
    with pytest.raises(UserError, match="not a cell folder"):
        load_policy(tmp_path)
    with pytest.raises(UserError, match="not a cell folder"):
        policy_and_task(tmp_path, None)


@pytest.mark.parametrize(("kind", "name"), [("task", "pull"), ("method", "guess")])
def test_a_cell_of_a_task_or_method_that_is_not_here_is_named(tmp_path: Path, kind: str, name: str) -> None:
    folder = store_cell(tmp_path, **{kind: name})
    with pytest.raises(UserError, match=rf"^{folder}/cell\.json: unknown {kind} '{name}'; choose from: "):
        load_policy(folder)
    assert misfit(open_cell(folder)).startswith(f"{folder}/cell.json: unknown {kind}")


@pytest.mark.usefixtures("toy")
def test_a_cell_is_judged_by_the_reward_and_on_the_instances_of_its_variant(tmp_path: Path) -> None:
    variants = (Variant.of(), Variant.of(alpha=0.3), Variant.of(finetune=2), Variant.of(rung=1, setting=1))
    validation = {"config": StoredConfig({**BUDGET.run, "instances": Sourced("validation", "axis")}, {})}
    stored = [
        store_cell(tmp_path, task="toy_reach", method="toy_search", variant=variant, **fields)
        for variant, fields in zip(variants, ({}, {}, {}, validation), strict=True)
    ]
    default, tradeoff, place, tuned = (problem_of(open_cell(folder)) for folder in stored)
    task = load_task("toy_reach")
    assert (default.tradeoff, default.evaluation_instances().tolist()) == (None, task.evaluation_instances().tolist())
    assert tradeoff.tradeoff == Tradeoff(0.3, 1.0)
    assert place.evaluation_instances().tolist() == task.fine_tuning_instances()[1][:1].tolist()
    assert tuned.evaluation_instances().tolist() == task.validation_instances().tolist()


@pytest.mark.usefixtures("toy")
def test_the_policy_on_disk_is_the_one_that_was_judged(tmp_path: Path) -> None:
    (cell,) = toy_cells()
    sweep([cell], tmp_path)
    folder = cell.folder(tmp_path)
    observation = np.zeros((2, 6), dtype=np.float32)
    design = load_policy(folder).design(observation)
    assert design.shape == (2, 1)
    lengths = np.loadtxt(folder / "evaluation.csv", delimiter=",", skiprows=1, usecols=1)
    np.testing.assert_allclose(lengths, 0.1 + (design[0, 0] + 1.0) * 0.5 * 0.9)
    assert policy_and_task(folder, "toy_reach")[1].name == "toy_reach"
    with pytest.raises(UserError, match="trained on 'toy_reach', not on 'push'"):
        policy_and_task(folder, "push")


@pytest.mark.usefixtures("toy")
def test_a_policy_of_another_version_of_its_task_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (cell,) = toy_cells()
    sweep([cell], tmp_path)
    folder = cell.folder(tmp_path)
    assert open_cell(folder).record.task_version == 1
    monkeypatch.setattr(ToyReach, "version", 2)
    with pytest.raises(UserError, match="trained on version 1 of task 'toy_reach', which is now at version 2"):
        load_policy(folder)


@pytest.mark.usefixtures("toy")
def test_a_damaged_policy_is_named(tmp_path: Path) -> None:
    (cell,) = toy_cells()
    sweep([cell], tmp_path)
    folder = cell.folder(tmp_path)
    damaged = folder / "policy.safetensors"
    damaged.write_bytes(damaged.read_bytes()[:-3])
    with pytest.raises(UserError, match=r"policy\.safetensors"):
        load_policy(folder)


def test_a_policy_that_was_trained_with_another_observation_says_so_in_one_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cells = [open_cell(VERSION_0_1_0 / "push" / method / "default" / "seed-00") for method in ("gnn_ppo", "cma_es")]
    assert [misfit(cell) for cell in cells] == ["", ""]
    space, task_class = load_task("push").state_space, type(load_task("push"))
    entries = dict(zip(space.names, zip(space.low, space.high, space.units, strict=True), strict=True))
    monkeypatch.setattr(task_class, "state_space", Box.of(**entries, wind=(-1.0, 1.0, "m/s")))
    with pytest.raises(ChangedTaskError, match=r"policy\.safetensors was trained with another obs.*again") as told:
        load_policy(cells[0].folder)
    assert "\n" not in str(told.value)
    assert misfit(cells[0]) == str(told.value)
    assert misfit(cells[1]) == "", "an open-loop plan observes nothing but the time"
