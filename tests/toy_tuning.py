"""A study that searches the settings of two toy methods, and a method whose return follows from its setting by hand.

`toy_aim` learns nothing: it makes a stick of a given length and holds it still, whatever the goal is.

Shapes: `N` instances.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from codesign_bench.config.search import Uniform
from codesign_bench.method import Array, BatchReport, Method, Policy, Problem, State
from codesign_bench.seeding import Streams
from codesign_bench.study import Study, Tuning
from codesign_bench.task import Floats, Task
from toy import TOLERANCE, ConstantPolicy, ToyReach


@dataclass(frozen=True)
class Config:
    """The one setting of the method."""

    length: float = field(default=0.5, metadata={"search": Uniform(0.1, 1.0)})
    """Length of every stick, m."""


class ToyAim(Method[Config]):
    """A stick of one length that is held still."""

    name = "toy_aim"
    label = "Toy aim"
    config_class = Config

    def __init__(self, problem: Problem, config: Config, streams: Streams) -> None:
        super().__init__(problem, config, streams)

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Mapping[str, tuple[Any, str]]:
        return {}

    def train(self, remaining_steps: int) -> BatchReport:
        """Use up the budget."""
        return BatchReport(remaining_steps, {})

    def policy(self) -> Policy:
        design = ToyReach.design_space.to_unit(np.array([self.config.length]))
        return ConstantPolicy(np.array([design[0], 0.0]))

    @classmethod
    def make_policy(cls, task: Task, config: Config, tensors: Mapping[str, Array]) -> Policy:
        return ConstantPolicy(tensors["vector"])

    def state(self) -> State:
        return State({}, {})

    def load_state(self, state: State) -> None:
        """There is nothing to restore."""


def return_by_hand(length: float, instances: Floats) -> float:
    """Return the mean return of `toy_aim` on instances (N, 1).

    Every step costs the distance to the goal. A hit ends the episode after the first step.
    """
    distance = np.abs(length - instances[:, 0])
    return float(-np.where(distance < TOLERANCE, distance, ToyReach.horizon * distance).mean())


STUDY = Study(
    name="toy_tuning",
    title="Toy tuning",
    question="Which length is best?",
    methods=("toy_aim", "toy_search"),
    tuning=Tuning(methods=("toy_aim", "toy_search"), tasks=("toy_reach",), settings=3, rungs=2, eta=3, seeds=(0,)),
)
