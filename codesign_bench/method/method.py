"""The interface of a method: it trains in batches, returns its current policy, and can be saved and restored.

Shapes: `B` batch (may be absent), `O` observation, `D` design, `C` control.
A new method is one file in `methods/` with one public subclass of `Method`. The runner owns budget, evaluation,
checkpoints, seeds and progress; a method only learns.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Generic, TypeVar

from numpy.typing import NDArray

from codesign_bench.errors import UserError
from codesign_bench.method.problem import Problem
from codesign_bench.seeding import Streams
from codesign_bench.task import Behaviour, Floats, Singles, Task

Array = NDArray[Any]


class Policy(Behaviour):
    """A trained designer and controller that act with their means, as used in evaluation and everything after it."""

    @abstractmethod
    def tensors(self) -> dict[str, Array]:
        """Return all arrays of the policy, by name; `Method.make_policy` restores the policy from them."""

    def design_values(self, observation: Singles, designs: Singles) -> Floats | None:
        """Return what the policy itself expects of designs, or None if it does not judge designs.

        Args:
            observation: (O,) of the design phase.
            designs: (P, D) in [-1, 1].

        Returns:
            (P,) values in any unit, higher for a design that it prefers.
        """
        return None


@dataclass
class State:
    """Everything a method needs to resume exactly where it stopped."""

    arrays: dict[str, Array]
    """Networks, optimizers and the like, by name."""
    values: dict[str, Any]
    """JSON values by name."""
    large: dict[str, Array] = field(default_factory=dict)
    """Arrays that take long to write, e.g. a replay buffer, by name.

    The runner streams them to a separate file; the longer that takes, the less often it saves. They need not be copies:
    they are written before training continues, and `Method.load_state` may keep the arrays it gets.
    """


@dataclass(frozen=True)
class BatchReport:
    """What one `Method.train` call did."""

    env_steps: int
    """Simulated environment steps, including design steps and the steps of all candidates."""
    metrics: dict[str, float]
    """Logged values by name; the method's page explains each."""
    gradient_steps: int = 0
    """Gradient steps that changed the policy."""


ConfigType = TypeVar("ConfigType")


class Method(ABC, Generic[ConfigType]):
    """A method that learns a tool's design together with its control, from task reward only."""

    name: ClassVar[str]
    """The method's name, which is also the name of its file."""
    label: ClassVar[str]
    """The method's name in figures; see `label_of`."""
    tool_per_goal: ClassVar[bool] = True
    """Whether the policy may design another tool for another goal; False: one tool for all goals. Written as a literal,
    for `list` reads it without importing the method."""
    config_class: ClassVar[type]
    """Frozen dataclass of the hyperparameters; every field has a default, and any task runs with the defaults."""

    def __init__(self, problem: Problem, config: ConfigType, streams: Streams) -> None:
        self.problem = problem
        self.config = config
        self.streams = streams

    @classmethod
    def label_of(cls, config: ConfigType) -> str:
        """Return the method's name in figures under `config`; by default `label`."""
        return cls.label

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Mapping[str, tuple[Any, str]]:
        """Return the method's own settings in `profile`: key -> (value, source). By default none.

        Profiles of studies may set more. An unknown profile or task gets general values.
        """
        return {}

    @classmethod
    def derived(cls, config: ConfigType, profile: str, task_name: str) -> Mapping[str, tuple[Any, str]]:
        """Return settings that follow from other settings of `config`, each with its source; by default none."""
        return {}

    @classmethod
    def check(cls, config: ConfigType, task_name: str) -> None:
        """Check that complete settings fit a task, before any cell runs with them; by default nothing.

        Raises:
            UserError: they do not.
        """

    @classmethod
    def small(cls) -> Mapping[str, Any]:
        """Return settings with which a batch takes a fraction of a second, for tests; by default none."""
        return {}

    @property
    def shortest_batch(self) -> int:
        """Most environment steps that `train` takes when one step is left: one episode, unless it compares several."""
        return self.problem.task.horizon + 1

    def use_cores(self, count: int) -> None:
        """Use up to `count` cores from now on; results must not depend on it. By default a method uses one core."""

    def use_device(self, name: str) -> None:
        """Compute updates on the device `name` ("cpu", "cuda") from now on. No-op by default."""

    def start_from(self, tensors: Mapping[str, Array]) -> None:
        """Start from a trained policy, given by `Policy.tensors`, before any training.

        Raises:
            UserError: the method does not support it.
        """
        raise UserError(f"method '{self.name}' cannot start from a trained policy")

    @abstractmethod
    def train(self, remaining_steps: int) -> BatchReport:
        """Collect one batch of whole episodes and learn from it.

        No episode is in progress when this returns, because checkpoints do not save simulators. Off-policy methods also
        collect whole episodes; they may update any number of times within a batch.

        Args:
            remaining_steps: environment steps left in the budget; the batch is about min(batch size, remaining steps)
                long, in whole episodes.
        """

    @abstractmethod
    def policy(self) -> Policy:
        """Return the current policy; later training may change it.

        With several cores, evaluation sends it to other processes by pickle.
        """

    @classmethod
    @abstractmethod
    def make_policy(cls, task: Task, config: ConfigType, tensors: Mapping[str, Array]) -> Policy:
        """Return the policy whose arrays `Policy.tensors` returned."""

    @abstractmethod
    def state(self) -> State:
        """Return what `load_state` needs to resume bit for bit; the runner saves the random streams."""

    @abstractmethod
    def load_state(self, state: State) -> None:
        """Resume from `state`; called on a new method with the same problem, config and seed."""
