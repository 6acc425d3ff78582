"""What a method is: it learns in batches, hands out its current policy, and can be saved and put back.

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
from codesign_bench.task import Behaviour, Task

Array = NDArray[Any]


class Policy(Behaviour):
    """A trained designer and controller that act with their means, as evaluation and everything after it uses them."""

    @abstractmethod
    def tensors(self) -> dict[str, Array]:
        """Return all numbers that the policy needs, by name; `Method.make_policy` takes them back."""


@dataclass
class State:
    """All that a method needs to resume exactly where it stopped."""

    arrays: dict[str, Array]
    """Networks, optimizers and the like, by name."""
    values: dict[str, Any]
    """JSON values by name."""
    large: dict[str, Array] = field(default_factory=dict)
    """Arrays that take long to write, such as a replay buffer, by name.

    The runner streams them to a separate file, and saves less often the longer that takes. They need not be copies:
    they are written before training continues, and `Method.load_state` may keep those that it is given.
    """


@dataclass(frozen=True)
class BatchReport:
    """What one `Method.train` call did."""

    env_steps: int
    """Simulated environment steps, design steps and every candidate's included."""
    metrics: dict[str, float]
    """Logged values by name, each explained on the method's page."""
    gradient_steps: int = 0
    """Gradient steps that changed the policy."""


ConfigType = TypeVar("ConfigType")


class Method(ABC, Generic[ConfigType]):
    """A way of learning a tool's design together with its control, from task reward alone."""

    name: ClassVar[str]
    """Its name, which is its file's name."""
    label: ClassVar[str]
    """Its name in figures."""
    config_class: ClassVar[type]
    """Frozen dataclass of its hyperparameters; each field's default is total, so that any task runs with it."""

    def __init__(self, problem: Problem, config: ConfigType, streams: Streams) -> None:
        self.problem = problem
        self.config = config
        self.streams = streams

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Mapping[str, tuple[Any, str]]:
        """Return what the method itself sets in `profile`: key -> (value, source). By default its defaults hold.

        Profiles of studies may set more; a profile or a task that the method does not know gets general values.
        """
        return {}

    @classmethod
    def derived(cls, config: ConfigType, profile: str, task_name: str) -> Mapping[str, tuple[Any, str]]:
        """Return settings that follow from the others of `config`, each with its source; by default none."""
        return {}

    @classmethod
    def small(cls) -> Mapping[str, Any]:
        """Return settings with which a batch takes a fraction of a second, for tests; by default the defaults do."""
        return {}

    @property
    def shortest_batch(self) -> int:
        """Most environment steps that `train` takes when one is left: an episode, unless several must be compared."""
        return self.problem.task.horizon + 1

    def use_cores(self, count: int) -> None:
        """Use up to `count` cores from now on; no number may depend on it. By default a method uses one."""

    def use_device(self, name: str) -> None:
        """Compute updates on the device `name` ("cpu", "cuda") from now on. By default a method has no use for one."""

    def start_from(self, tensors: Mapping[str, Array]) -> None:
        """Take over a trained policy, as `Policy.tensors` described it, before any training.

        Raises:
            UserError: the method cannot.
        """
        raise UserError(f"method '{self.name}' cannot start from a trained policy")

    @abstractmethod
    def train(self, remaining_steps: int) -> BatchReport:
        """Collect one batch of whole episodes and learn from it.

        No episode is in progress when this returns: a checkpoint holds no simulator. That goes for off-policy methods,
        too: they may update as often as they like within a batch, but they collect whole episodes.

        Args:
            remaining_steps: environment steps left in the budget; the batch is about min(batch size, remaining steps)
                long, in whole episodes.
        """

    @abstractmethod
    def policy(self) -> Policy:
        """Return the policy as it stands; later training may change it."""

    @classmethod
    @abstractmethod
    def make_policy(cls, task: Task, config: ConfigType, tensors: Mapping[str, Array]) -> Policy:
        """Return the policy that `Policy.tensors` described."""

    @abstractmethod
    def state(self) -> State:
        """Return what `load_state` needs to resume bit for bit; the runner saves the random streams."""

    @abstractmethod
    def load_state(self, state: State) -> None:
        """Resume from `state`; called on a freshly built method with the same problem, config and seed."""
