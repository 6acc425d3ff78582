"""What the tests of the learning core share: a small learner on a task whose numbers are known by hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from codesign_bench.learning.two_phase import TwoPhaseLearner
from codesign_bench.method import Problem, load_method
from codesign_bench.seeding import Streams
from codesign_bench.task import Task, load_task

MakeLearner = Callable[..., TwoPhaseLearner]
SMALL = {"policy_net": (16, 16), "value_net": (16, 16), "minibatch_size": 20, "design_minibatch_size": 10}


@pytest.fixture
def reach(toy: None) -> Task:
    """A stick on a line, five control steps an episode."""
    return load_task("toy_reach")


@pytest.fixture
def make_learner(reach: Task) -> MakeLearner:
    """Return a function that makes the learner of `shared_arch` with small networks; keywords change its config."""

    def make(seed: int = 0, **changes: Any) -> TwoPhaseLearner:
        method_class = load_method("shared_arch")
        config = replace(method_class.config_class(), **(SMALL | {"batch_size": 60} | changes))
        method: Any = method_class(Problem(reach), config, Streams(seed))
        learner: TwoPhaseLearner = method.learner
        return learner

    return make
