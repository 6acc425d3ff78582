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


@pytest.fixture
def connected(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The worlds that PyBullet makes during the test."""
    made: list[int] = []
    connect = bullet.pybullet.connect

    def remember(*arguments: Any, **options: Any) -> int:
        made.append(connect(*arguments, **options))
        return made[-1]

    monkeypatch.setattr(bullet.pybullet, "connect", remember)
    return made


def test_worlds_are_made_when_used_and_handed_on(connected: list[int]) -> None:
    task, slots = load_task("fetch_cube"), np.arange(3)

    def begun(num_slots: int) -> Any:
        simulator = task.make_simulator(num_slots)
        simulator.begin(slots, task.evaluation_instances()[:3])
        return simulator

    first, second = begun(1_000), begun(3)
    assert len(connected) <= 6, "slots that nobody begins need no world"
    assert not set(first.worlds[:3]) & set(second.worlds), "a world belongs to one simulator"
    assert set(connected) <= {*first.worlds, *second.worlds}
    handed_on, before = set(first.worlds[:3]), len(connected)
    del first
    gc.collect()
    assert not set(begun(3).worlds) & set(second.worlds)
    assert len(connected) == before, "the worlds of a simulator that is gone are there to be used"
    assert all(bullet.pybullet.isConnected(world) for world in handed_on)


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
    with pytest.raises(UserError, match="3D tasks need pybullet, which is not installed"):
        load_task("fetch_cube")
    assert load_task("push").name == "push"
