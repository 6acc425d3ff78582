"""Makes sound and broken members known by their names, as checks load them again."""

from __future__ import annotations

from typing import Any

import pytest

from codesign_bench import registry
from codesign_bench.contract import Check, Subject, ask
from codesign_bench.task import Task
from contract_faults import FaultsOf, text_of
from sound import SoundReach, changed_method, changed_task


@pytest.fixture
def task_faults(toy: None, monkeypatch: pytest.MonkeyPatch) -> FaultsOf:
    """Return a function that asks a changed `SoundReach` for one promise; it returns what was found, in lines."""

    def faults(check: Check[Task], simulator: dict[str, Any] | None = None, **attributes: Any) -> str:
        task_class = changed_task(simulator, **attributes)
        registry.register("tasks", task_class.name, lambda: task_class)
        return text_of(ask(check, task_class(), SoundReach))

    return faults


@pytest.fixture
def method_faults(toy: None) -> FaultsOf:
    """Return a function that asks a changed `SoundSearch` on `SoundReach` for one promise, likewise."""

    def faults(check: Check[Subject], **attributes: Any) -> str:
        method_class = changed_method(**attributes)
        registry.register("methods", method_class.name, lambda: method_class)
        return text_of(ask(check, Subject(method_class, SoundReach()), method_class))

    return faults
