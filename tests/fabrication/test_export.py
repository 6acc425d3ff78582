"""The command, on a shipped policy: which tools are written, what their sheets say, what is refused."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from builders import VERSION_0_1_0
from codesign_bench import load_task, task_names
from codesign_bench.cli import main
from codesign_bench.errors import UserError
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.fabrication.export import Order, export
from codesign_bench.task.behaviours import RandomBehaviour

PUSH = VERSION_0_1_0 / "push" / "gnn_ppo" / "default" / "seed-00"
ONE_TOOL = VERSION_0_1_0 / "push" / "cma_rl" / "default" / "seed-00"
FETCH = VERSION_0_1_0 / "fetch_cube" / "gnn_ppo" / "default" / "seed-00"

trimesh = pytest.importorskip("trimesh")


def sheet(folder: Path) -> dict:
    """Return the one sheet in a folder."""
    (path,) = folder.glob("*.json")
    return dict(json.loads(path.read_text()))


def test_the_tool_is_the_one_that_evaluation_used(tmp_path: Path) -> None:
    assert main(["export", "--policy", str(PUSH), "--instances", "3", "--scale", "0.02", "--out", str(tmp_path)]) == 0
    row = pd.read_csv(PUSH / "evaluation.csv").iloc[3]
    values = sheet(tmp_path)
    assert values["design"] == pytest.approx({name: row[f"design_{name}"] for name in values["design"]}, rel=1e-5)


def test_one_tool_for_all_instances_is_written_once(tmp_path: Path) -> None:
    order = ["export", "--policy", str(ONE_TOOL), "--task", "push", "--instances", "all", "--scale", "0.02"]
    assert main([*order, "--out", str(tmp_path)]) == 0
    table = pd.read_csv(tmp_path / "tools.csv")
    assert len(table) == 1
    assert len(sheet(tmp_path)["instances"]) == load_task("push").num_evaluation_instances


@pytest.mark.parametrize("name", task_names())
def test_every_task_exports_tools_of_every_instance_asked_for(name: str, tmp_path: Path) -> None:
    task = load_task(name)
    policy = RandomBehaviour(task, np.random.default_rng(0))
    lines: list[str] = []
    prints = export(task, policy, Order.of(task, instances="0,2"), tmp_path, lines.append)
    assert len(prints) == len(list(tmp_path.glob("*.stl"))) == 2
    assert all(result.watertight and result.bodies == 1 for result in prints)
    assert all(bool(result.problems) != result.printable for result in prints)
    assert len(lines) == 3


@pytest.mark.parametrize("name", task_names())
def test_a_goal_stands_in_its_instance(name: str) -> None:
    task = load_task(name)
    goal = task.evaluation_instances()[5, : task.goal_size]
    order = Order.of(task, goal=",".join(repr(float(value)) for value in goal))
    assert order.instances[0, : task.goal_size].tolist() == goal.tolist()
    evaluate(task, RandomBehaviour(task, np.random.default_rng(0)), instances=order.instances)


def test_without_the_extra_the_way_to_it_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "manifold3d", None)
    task = load_task("push")
    with pytest.raises(UserError, match=r"pip install 'codesign-bench\[export\]'"):
        export(task, task.script(), Order.of(task, instances="0"), tmp_path, print)
    assert list(tmp_path.iterdir()) == []


def test_tools_are_written_all_or_none(tmp_path: Path) -> None:
    task = load_task("push")

    def stop_at_the_second(line: str) -> None:
        if "instance-002" in line:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        export(task, task.script(), Order.of(task, instances="0,2"), tmp_path, stop_at_the_second)
    assert list(tmp_path.iterdir()) == []
