"""What the tests of the learning core share: a small learner on a task whose numbers are known by hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from codesign_bench.learning.ppo import PolicyUpdate, Update, ValueUpdate
from codesign_bench.learning.two_phase import GiveDesigns, TwoPhaseLearner
from codesign_bench.learning.update_loop import UpdateLoop
from codesign_bench.method import Problem, load_method
from codesign_bench.seeding import Streams
from codesign_bench.task import Slots, Task, load_task

MakeLearner = Callable[..., TwoPhaseLearner]
SMALL = {"policy_net": (16, 16), "value_net": (16, 16), "minibatch_size": 20, "design_minibatch_size": 10}


class Recorder(UpdateLoop):
    """Remembers which updates took a step on which rows."""

    def __init__(self) -> None:
        super().__init__()
        self.steps: list[tuple[Update, Slots]] = []

    def step(self, update: Update, rows: Slots) -> None:
        """Remember the step and take it."""
        self.steps.append((update, rows))
        super().step(update, rows)

    @property
    def policies(self) -> list[PolicyUpdate]:
        """The policy updates, in the order of their first steps."""
        return list(dict.fromkeys(update for update, _ in self.steps if isinstance(update, PolicyUpdate)))

    @property
    def values(self) -> list[ValueUpdate]:
        """The value updates, in the order of their first steps."""
        return list(dict.fromkeys(update for update, _ in self.steps if isinstance(update, ValueUpdate)))

    def rows(self, update: Update) -> list[int]:
        """Return all rows that `update` was stepped with, in order."""
        return [row for other, rows in self.steps if other is update for row in rows.tolist()]


@pytest.fixture
def recorder() -> Recorder:
    """Listen to the updates of a learner that is made with it as `loop`."""
    return Recorder()


@pytest.fixture
def reach(toy: None) -> Task:
    """A stick on a line, five control steps an episode."""
    return load_task("toy_reach")


@pytest.fixture
def make_learner(reach: Task) -> MakeLearner:
    """Return a function that makes a learner with the networks of `shared_arch`, small; keywords change its config."""

    def make(
        seed: int = 0,
        give_designs: GiveDesigns | None = None,
        loop: UpdateLoop | None = None,
        problem: Problem | None = None,
        **changes: Any,
    ) -> TwoPhaseLearner:
        method_class: Any = load_method("shared_arch")
        config = replace(method_class.config_class(), **(SMALL | {"batch_size": 60} | changes))
        streams = Streams(seed)
        actor = method_class.make_actor(reach, config, streams["policy weights"])
        value = method_class.make_value(reach, config, streams["value weights"])
        return TwoPhaseLearner(problem or Problem(reach), config, streams, actor, value, give_designs, loop)

    return make
