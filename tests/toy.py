"""A task and a method small enough to run in milliseconds, for tests of everything around them.

`toy_reach`: a stick of 0.1 to 1 m, held at 0 m, shall touch a goal on a line; its foot moves 0.1 m a step.
`toy_search`: random search over a constant design and control; options make it slow, fail or kill itself. A file may
hold it up, too: while the file named by `TOY_GATE` holds a number, nothing is trained beyond so many steps.

Shapes: `B` batch (may be absent), `b` slots that a call names, `O` observation, `D` design, `C` control, `I` instance.
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from codesign_bench.config.search import Integer, LogUniform
from codesign_bench.method import Array, BatchReport, Method, Policy, Problem, State
from codesign_bench.seeding import Streams
from codesign_bench.task import Booleans, Box, Floats, Simulator, Singles, Slots, Task, ToolGraph

GATE_VARIABLE = "TOY_GATE"
STEP = 0.1
TOLERANCE = 0.05


class ToyReach(Task):
    """Touch the goal with the tip of a stick."""

    name = "toy_reach"
    title = "Toy reach"
    horizon = 5
    control_period = 0.1
    design_space = Box.of(length=(0.1, 1.0, "m"))
    tool_graph = ToolGraph(num_nodes=1, edges=(), parameter_nodes=(0,))
    control_space = Box.of(speed=(-1.0, 1.0, "m/s"))
    instance_space = Box.of(goal=(0.0, 1.0, "m"))
    goal_size = 1
    position_entries = ("goal",)
    state_space = Box.of(tip=(-2.0, 2.0, "m"))
    num_evaluation_instances = 8

    def in_cutout(self, instances: Floats, fraction: float) -> Booleans:
        """Cut out the goals below `fraction`."""
        return np.asarray(instances[:, 0] < fraction)

    def fine_tuning_instances(self) -> Floats:
        """Two places, one of them out of the training region, with two goals each."""
        return np.array([[[1.2], [1.25]], [[0.3], [0.35]]])

    def material(self, designs: Floats) -> Floats:
        """The stick's length over the longest."""
        return designs[:, 0] / 1.0

    def effort(self, controls: Floats) -> Floats:
        """The speed over the highest."""
        return np.abs(controls[:, 0])

    def make_simulator(self, num_slots: int) -> Simulator:
        """Return sticks on a line."""
        return _Sticks(num_slots)


class _Sticks(Simulator):
    def __init__(self, num_slots: int) -> None:
        super().__init__(num_slots, state_size=1)
        self._goal, self._tip = np.zeros(num_slots), np.zeros(num_slots)

    def begin(self, slots: Slots, instances: Floats) -> None:
        self._goal[slots], self._tip[slots] = instances[:, 0], 0.0
        self.success[slots] = self.failure[slots] = False
        self.reward[slots] = 0.0
        self.state[slots, 0] = 0.0

    def build(self, slots: Slots, designs: Floats) -> None:
        self._tip[slots] = designs[:, 0]
        self.state[slots, 0] = self._tip[slots]

    def step(self, slots: Slots, controls: Floats) -> None:
        self._tip[slots] += STEP * controls[:, 0]
        distance = np.abs(self._tip[slots] - self._goal[slots])
        self.success[slots] = distance < TOLERANCE
        self.reward[slots] = -distance
        self.state[slots, 0] = self._tip[slots]


class Gate:
    """Holds up every cell of `toy_search`, here and in other processes."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def close_at(self, env_steps: int) -> None:
        """Let no cell train further once it has taken `env_steps`."""
        part = self.path.with_suffix(".part")
        part.write_text(str(env_steps))
        part.replace(self.path)

    def open(self) -> None:
        """Hold up nothing any more."""
        self.path.unlink(missing_ok=True)


def _gate() -> float:
    """Return the environment steps up to which training may go."""
    try:
        return float(Path(os.environ[GATE_VARIABLE]).read_text())
    except (KeyError, FileNotFoundError):
        return np.inf


@dataclass(frozen=True)
class Config:
    """Options of the search."""

    episodes: int = field(default=4, metadata={"search": Integer(2, 8)})
    step_size: float = field(default=0.3, metadata={"source": "toy paper, table 1", "search": LogUniform(0.01, 1.0)})
    widths: tuple[int, ...] = (8, 8)
    decay: float | None = None
    greedy: bool = True
    delay: float = 0.0
    """Seconds that every batch takes."""
    fail_at: int | None = None
    """Environment steps from which on training raises an error."""
    die_at: int | None = None
    """Environment steps from which on training kills its process."""

    def __post_init__(self) -> None:
        if self.step_size <= 0.0:
            raise ValueError(f"step_size must be positive, not {self.step_size}")


class ToySearch(Method[Config]):
    """Keeps a random neighbour when its mean return is higher."""

    name = "toy_search"
    label = "Toy search"
    config_class = Config

    def __init__(self, problem: Problem, config: Config, streams: Streams) -> None:
        super().__init__(problem, config, streams)
        self.best = streams["start"].uniform(-1.0, 1.0, size=2)
        self.best_return = -np.inf
        self.env_steps = 0

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Mapping[str, tuple[Any, str]]:
        return {"episodes": (8, "toy paper, table 2")} if profile == "paper" else {}

    def train(self, remaining_steps: int) -> BatchReport:
        """Judge one neighbour."""
        self._misbehave()
        candidate = np.clip(self.best + self.config.step_size * self.streams["search"].normal(size=2), -1.0, 1.0)
        earned, env_steps = self._rollout(ConstantPolicy(candidate), self.config.episodes)
        if earned > self.best_return:
            self.best, self.best_return = candidate, earned
        self.env_steps += env_steps
        return BatchReport(env_steps, {"candidate_return": earned}, gradient_steps=1)

    def start_from(self, tensors: Mapping[str, Array]) -> None:
        """Take over a vector."""
        self.best = np.asarray(tensors["vector"])

    def _misbehave(self) -> None:
        time.sleep(self.config.delay)
        while self.env_steps >= _gate():
            time.sleep(0.01)
        if self.config.fail_at is not None and self.env_steps >= self.config.fail_at:
            raise RuntimeError("the toy broke")
        if self.config.die_at is not None and self.env_steps >= self.config.die_at:
            os.kill(os.getpid(), signal.SIGKILL)

    def _rollout(self, policy: Policy, count: int) -> tuple[float, int]:
        slots, earned, env_steps = np.arange(count), 0.0, count
        with self.problem.episodes(count) as episodes:
            episodes.begin(slots, self.problem.sample_instances(self.streams["instances"], count))
            episodes.design(slots, np.asarray(policy.design(episodes.observation[slots]), dtype=np.float64))
            while slots.size:
                controls = np.asarray(policy.act(episodes.observation[slots]), dtype=np.float64)
                reward, terminated, truncated = episodes.control(slots, controls)
                earned += float(reward.sum())
                env_steps += slots.size
                slots = slots[~(terminated | truncated)]
        return earned / count, env_steps

    def policy(self) -> Policy:
        return ConstantPolicy(self.best.copy())

    @classmethod
    def make_policy(cls, task: Task, config: Config, tensors: Mapping[str, Array]) -> Policy:
        return ConstantPolicy(tensors["vector"])

    def state(self) -> State:
        return State({"best": self.best}, {"best_return": self.best_return, "env_steps": self.env_steps})

    def load_state(self, state: State) -> None:
        self.best = state.arrays["best"]
        self.best_return, self.env_steps = state.values["best_return"], state.values["env_steps"]


class ConstantPolicy(Policy):
    """The same design and control, whatever the observation; both in one vector (D + C,)."""

    def __init__(self, vector: Array) -> None:
        self.vector = np.asarray(vector)

    def design(self, observation: Singles) -> Singles:
        return np.broadcast_to(self.vector[:1].astype(np.float32), (*observation.shape[:-1], 1))

    def act(self, observation: Singles) -> Singles:
        return np.broadcast_to(self.vector[1:].astype(np.float32), (*observation.shape[:-1], 1))

    def tensors(self) -> dict[str, Array]:
        return {"vector": self.vector}
