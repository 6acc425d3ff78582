"""What the tests of the methods share: any method, made small."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from codesign_bench.method import Method, Problem, load_method
from codesign_bench.seeding import Streams
from codesign_bench.task import Task, load_task


def small_config(method_class: type[Method[Any]], **changes: Any) -> Any:
    """Return a method's small configuration, changed."""
    return replace(method_class.config_class(), **{**method_class.small(), **changes})


@pytest.fixture(scope="session")
def push() -> Task:
    """The smallest real task."""
    return load_task("push")


@pytest.fixture
def make_method(push: Task) -> Callable[..., Method[Any]]:
    """Return a function that makes the method `name`, small, with a seed and changes of its configuration."""

    def make(name: str, seed: int = 0, **changes: Any) -> Method[Any]:
        method_class = load_method(name)
        return method_class(Problem(push), small_config(method_class, **changes), Streams(seed))

    return make
