"""All checks of a task: a sound task passes every one, and what is wrong first comes first."""

from __future__ import annotations

import importlib
import re

import pytest

from codesign_bench import registry
from codesign_bench.contract import METHOD_CHECKS, TASK_CHECKS, Check, Subject, examine_task
from codesign_bench.contract.methods import LOADS as METHOD_LOADS
from codesign_bench.contract.tasks import LOADS
from codesign_bench.task import Task
from sound import SoundReach, changed_task

EVERY_CHECK: tuple[Check[str] | Check[Task] | Check[Subject], ...] = (LOADS, *TASK_CHECKS, METHOD_LOADS, *METHOD_CHECKS)


def test_a_sound_task_passes_every_check_and_none_is_left_out(toy: None) -> None:
    registry.register("tasks", SoundReach.name, lambda: SoundReach)
    verdicts = list(examine_task(SoundReach.name))
    assert [verdict.check for verdict in verdicts] == [LOADS, *TASK_CHECKS]
    assert [(verdict.faults, verdict.left_out) for verdict in verdicts] == [((), "")] * len(verdicts)


def test_nothing_is_asked_after_a_fault_that_leaves_it_no_meaning(toy: None) -> None:
    task_class = changed_task(goal_size=7)
    registry.register("tasks", task_class.name, lambda: task_class)
    asked = list(examine_task(task_class.name))
    assert asked[-1].check.first
    assert asked[-1].faults
    assert len(asked) < 5


@pytest.mark.parametrize("check", EVERY_CHECK, ids=lambda check: check.name)
def test_a_check_says_what_is_promised_and_where_to_read_more(check: Check[Task]) -> None:
    assert re.fullmatch(r"[A-Z].*\.", check.promise)
    assert documented(check.read)


def documented(name: str) -> bool:
    """Return whether the full name is that of a class or function with a docstring, or of an attribute of a class."""
    *modules, last = name.split(".")
    owner = None
    for part in modules:
        if part[0].isupper():
            owner = getattr(importlib.import_module(".".join(modules[: modules.index(part)])), part)
    if owner is None:
        return bool(getattr(importlib.import_module(".".join(modules)), last).__doc__)
    return last in owner.__annotations__ or bool(vars(owner)[last].__doc__)
