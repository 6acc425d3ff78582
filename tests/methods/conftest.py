"""What the tests of the methods share: any method, made small by the fields that its configuration has."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest

from codesign_bench import plugins, registry
from codesign_bench.method import Method, Problem, load_method
from codesign_bench.seeding import Streams
from codesign_bench.task import Task, load_task

EXAMPLE = Path(__file__).parent.parent / "third_party"

SMALL: dict[str, Any] = {
    "batch_size": 600,
    "minibatch_size": 150,
    "epochs": 2,
    "design_epochs": 2,
    "design_minibatch_size": 2,
    "popsize": 4,
    "episodes_per_candidate": 1,
    "policy_net": (16, 16),
    "value_net": (16, 16),
    "control_gnn": (16, 16),
    "control_index_mlp": (16,),
    "design_gnn": (16, 16),
    "design_index_mlp": (16,),
    "value_mlp": (16,),
    "hidden": (16,),
    "replay_size": 1_000,
    "updates_per_step": 0.02,
}
"""What is set in a configuration that has the field, for batches of a few episodes with small networks.

Updates are so few that weights stay about as they start.
"""


def small_config(method_class: type[Method[Any]], **changes: Any) -> Any:
    """Return the defaults of a method's configuration, made small."""
    config = method_class.config_class()
    known = {field.name for field in fields(config)}
    return replace(config, **{name: value for name, value in (SMALL | changes).items() if name in known})


@pytest.fixture(autouse=True)
def example(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the example package's off-policy method known."""
    monkeypatch.syspath_prepend(str(EXAMPLE))
    monkeypatch.setenv(registry.IMPORTS_VARIABLE, "")
    monkeypatch.setattr(registry, "_registered", {})
    plugins.import_modules(["reach_example.sac"])


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
