"""What the tasks in PyBullet share: worlds that are handed on, and a word about PyBullet where it is missing."""

from __future__ import annotations

import gc
import sys
from importlib import import_module
from typing import Any

import numpy as np
import pytest

from codesign_bench.errors import UserError
from codesign_bench.task import load_task

bullet: Any = import_module("codesign_bench.tasks._bullet")


def test_worlds_are_made_when_used_and_handed_on() -> None:
    task, slots = load_task("fetch_cube"), np.arange(3)
    first: Any = task.make_simulator(1_000)
    assert set(first.worlds) == {None}
    first.begin(slots, task.evaluation_instances()[:3])
    used = set(first.worlds[:3])
    assert not used & {None, *bullet._idle_worlds}
    del first
    gc.collect()
    assert used <= set(bullet._idle_worlds)
    second: Any
    third: Any
    second, third = (task.make_simulator(3) for _ in range(2))
    before = set(bullet._idle_worlds)
    for simulator in (second, third):
        simulator.begin(slots, task.evaluation_instances()[:3])
    assert set(second.worlds) <= before
    assert not set(second.worlds) & set(third.worlds), "a world belongs to one simulator"


@pytest.mark.numeric
def test_rotations_by_hand() -> None:
    quarter = bullet.rotations_about(2, np.array([0.5 * np.pi]))
    np.testing.assert_allclose(quarter, [[0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]])
    turned = bullet.rotation_matrices(quarter)[0] @ [1.0, 0.0, 0.0]
    np.testing.assert_allclose(turned, [0.0, 1.0, 0.0], atol=1e-12)


def test_without_pybullet_the_task_says_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("fetch_cube", "_bullet", "_carriers"):
        monkeypatch.delitem(sys.modules, f"codesign_bench.tasks.{name}")
    monkeypatch.setitem(sys.modules, "pybullet", None)
    with pytest.raises(UserError, match="pip install pybullet"):
        load_task("fetch_cube")
    assert load_task("push").name == "push"
