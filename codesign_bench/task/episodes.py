"""The two-phase episode on any simulator: one design step, then control until success, failure or the time limit.

Shapes: `B` slots, `b` the slots of a call, `O` observation, `D` design, `C` control, `I` instance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codesign_bench.task.checks import NotCopied, check_finite, check_rows, check_slots
from codesign_bench.task.simulator import Simulator
from codesign_bench.task.spaces import Booleans, Box, Floats, Singles, Slots
from codesign_bench.task.task import Task

TRADEOFF_TERM, TASK_TERM = "tradeoff", "task"
"""Names of reward terms: the trade-off reward, and the task's reward if the task names no terms."""


@dataclass(frozen=True)
class Tradeoff:
    """The auxiliary reward of equation 1; `alpha` weights material against control effort, `scale` is the paper's K."""

    alpha: float
    scale: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.alpha <= 1.0 or not np.isfinite(self.scale):
            raise ValueError(f"alpha must be in [0, 1] and scale finite, not alpha={self.alpha}, scale={self.scale}")

    def reward(self, material: Floats, effort: Floats) -> Floats:
        """Return K [1 - (alpha d_used/d_max + (1 - alpha) c_used/c_max)] for (b,) fractions in [0, 1]."""
        # Both fractions are relative to the task's maximum. So alpha weights comparable numbers, and the reward is
        # between 0 and K on every task. As it is a bonus, not a cost, ending an episode early by failure gains nothing.
        return self.scale * (1.0 - (self.alpha * material + (1.0 - self.alpha) * effort))


def portions(count: int, task: Task) -> list[Slots]:
    """Split 0 ... `count` - 1 into the fewest near-equal portions that fit in `max_slots` of the task."""
    return list(np.array_split(np.arange(count), -(-count // task.max_slots)))


class Episodes(NotCopied):
    """Runs independent two-phase episodes, one per slot, and keeps their observations (B, O) in one array.

    The calls of an episode are `begin`, `design`, then `control` until it is terminated or truncated. The design step
    counts as an environment step and has reward 0. A call with values of another shape, or that are not finite, is
    refused before it changes anything.

    Raises:
        TypeError: the task's simulator has fewer slots than requested, or a state of another shape than its space.
    """

    def __init__(
        self, task: Task, num_slots: int, tradeoff: Tradeoff | None = None, simulator: Simulator | None = None
    ) -> None:
        self.task = task
        self.tradeoff = tradeoff
        self.layout = task.layout
        self.simulator = task.make_simulator(num_slots) if simulator is None else simulator
        _check_simulator(self.simulator, task, num_slots)
        self.num_slots = num_slots = self.simulator.num_slots
        """B: the requested number, or more if a wider simulator was passed in."""
        self.observation: Singles = np.zeros((num_slots, self.layout.size), dtype=np.float32)
        self.elapsed = np.zeros(num_slots, dtype=np.intp)
        """(B,) control steps since the design step."""
        self.designs: Floats = np.zeros((num_slots, task.design_space.size))
        """(B, D) designs of the tools, in the design space's units."""
        self.reward_terms: dict[str, Floats] = {}
        """Name -> (B,): the terms that add up to the last control step's reward; empty before any control step."""
        self._material = np.zeros(num_slots)
        space = task.state_space
        self._state_low, self._state_high = np.array(space.low, np.float32), np.array(space.high, np.float32)

    def begin(self, slots: Slots, instances: Floats) -> None:
        """Start an episode of each instance (b, I) in its slot, in the design phase.

        Instances may be outside of the instance space, for example to extrapolate.

        Raises:
            ValueError: instances have another shape or are not finite, or there are no such slots.
        """
        check_slots(slots, self.num_slots)
        check_rows(instances, slots, self.task.instance_space, "instances")
        check_finite(instances, self.task.instance_space, "an instance")
        self.simulator.begin(slots, instances)
        self.elapsed[slots] = 0
        self.observation[slots, self.layout.goal] = instances[:, : self.task.goal_size]
        self.observation[slots, self.layout.design] = 0.0
        self.observation[slots, self.layout.phase] = (1.0, 0.0, 0.0)
        self._observe(slots)

    def design(self, slots: Slots, unit_designs: Floats) -> None:
        """Take the design step with normalised `unit_designs` (b, D), clipped to [-1, 1].

        This is the only place where a normalised design is converted to physical units; the result is in `designs`.

        Raises:
            ValueError: designs have another shape or are not finite.
        """
        clipped = _clipped(unit_designs, slots, self.task.design_space, "design")
        designs = self.designs[slots] = self.task.design_space.from_unit(clipped)
        self.simulator.build(slots, designs)
        if self.tradeoff is not None:
            # Equation 1 charges the material at every control step, although the design fixes it once.
            self._material[slots] = self.task.material(designs)
        self.observation[slots, self.layout.design] = clipped
        self.observation[slots, self.layout.phase] = (0.0, 1.0, 0.0)
        self._observe(slots)

    def control(self, slots: Slots, controls: Floats) -> tuple[Floats, Booleans, Booleans]:
        """Take one control step with `controls` (b, C), clipped to [-1, 1].

        Returns:
            reward, terminated (success or failure) and truncated (time limit), each (b,).

        Raises:
            ValueError: controls have another shape or are not finite.
            RuntimeError: the task's state or reward is not finite.
        """
        clipped = _clipped(controls, slots, self.task.control_space, "control")
        simulator = self.simulator
        simulator.step(slots, clipped)
        self.elapsed[slots] += 1
        reward = simulator.reward[slots]
        if not np.isfinite(reward).all():
            raise RuntimeError(f"task '{self.task.name}' gave a reward that is not finite: {reward}")
        self.reward_terms.update(simulator.reward_terms or {TASK_TERM: simulator.reward})
        if self.tradeoff is not None:
            saved = self.tradeoff.reward(self._material[slots], self.task.effort(clipped))
            self.reward_terms.setdefault(TRADEOFF_TERM, np.zeros(self.num_slots))[slots] = saved
            reward = reward + saved
        self.observation[slots, self.layout.phase.stop - 1] = self.elapsed[slots] / self.task.horizon
        self._observe(slots)
        terminated = simulator.success[slots] | simulator.failure[slots]
        # Success on the last step counts as success: truncation would let a learner bootstrap beyond it.
        truncated = (self.elapsed[slots] >= self.task.horizon) & ~terminated
        return reward, terminated, truncated

    def success(self, slots: Slots) -> Booleans:
        """Return which episodes in `slots` (b,) are solved."""
        return self.simulator.success[slots]

    def _observe(self, slots: Slots) -> None:
        state = self.simulator.state[slots]
        if not np.isfinite(state).all():
            raise RuntimeError(f"task '{self.task.name}' gave a state that is not finite: {self._not_finite(state)}")
        # A body that is flung out of the scene must not hand the networks values far outside the bounds of the spaces.
        self.observation[slots, self.layout.state] = np.clip(state, self._state_low, self._state_high)

    def _not_finite(self, state: Singles) -> str:
        names = np.array(self.task.state_space.names)
        return ", ".join(names[~np.isfinite(state).all(axis=0)])


def _check_simulator(simulator: Simulator, task: Task, num_slots: int) -> None:
    """Check that a task's simulator has the shapes that the task declares."""
    found, size = simulator.state.shape, task.state_space.size
    if simulator.num_slots < num_slots or found != (simulator.num_slots, size):
        raise TypeError(
            f"the simulator of task '{task.name}' has {simulator.num_slots} slots and a state of shape {found}; "
            f"expected at least {num_slots} slots and {size} entries of the state space"
        )


def _clipped(values: Floats, slots: Slots, space: Box, what: str) -> Floats:
    check_rows(values, slots, space, f"{what}s")
    # Checked before clipping, which would turn an infinity into a valid action and hide a diverged network.
    check_finite(values, space, f"a {what}")
    return np.clip(values, -1.0, 1.0).astype(np.float64, copy=False)
