"""A batched simulator of one task, and what it promises of its physics.

Shapes: `B` slots of a simulator, `b` the slots a call names, `I` instance, `S` state, `D` design, `C` control.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from codesign_bench.task.spaces import Booleans, Floats, Frame, Singles, Slots
from codesign_bench.task.tool import ToolPart


@dataclass(frozen=True)
class Physics:
    """What a scene looks like to someone who checks its physics."""

    overlap: float
    """Deepest overlap of two bodies that should not overlap, m; 0 when none do."""
    speed: float
    """Speed of the fastest body, the tool's excepted, m/s."""
    contained: bool
    """Whether every body is on its side of every wall and floor (or lies where it could have fallen)."""


@dataclass(frozen=True)
class Soundness:
    """What a task promises of its physics, for any design and any control; tests hold it to that."""

    overlap: float
    """No two bodies overlap deeper than this, m."""
    speed: float
    """Nothing but the tool is ever faster than this, m/s."""
    outcome_change: float
    """Halving the physics step changes the outcome of a scripted episode by less than this, in the outcome's unit.

    It holds for the median episode; where contact is chaotic, for the mean over instances, and a two-sample
    Kolmogorov-Smirnov test finds no difference between the outcomes' distributions.
    """
    start_overlap: float = 1e-3
    """Right after the design step, no design overlaps anything deeper than this, m."""
    chaotic: bool = False
    """Whether many bodies in contact make single episodes depend on the last bit."""


class Simulator(ABC):
    """Many independent episodes of one task in one process; slot `i` holds one episode.

    A call names the slots it means and touches no other. What happens in a slot depends on what was sent to that
    slot since its `begin` alone, so an episode is the same alone and in any batch, in a new simulator and in one that
    has played before: simulators are kept and used again.
    """

    def __init__(self, num_slots: int, state_size: int) -> None:
        self.num_slots = num_slots
        self.state: Singles = np.zeros((num_slots, state_size), dtype=np.float32)
        """(B, S) task state, written in place."""
        self.reward: Floats = np.zeros(num_slots)
        """(B,) reward of the last step."""
        self.reward_terms: dict[str, Floats] = {}
        """Name -> (B,): what the last step's reward is the sum of, as far as the task names it."""
        self.conditions: dict[str, Booleans] = {}
        """Name -> (B,): whether each condition of success holds now, as far as the task names them."""
        self.met_steps: Slots = np.zeros(num_slots, dtype=np.intp)
        """(B,) control steps in a row, up to now, in which all conditions of success held."""
        self.success: Booleans = np.zeros(num_slots, dtype=bool)
        """(B,) whether the task is solved; ends the episode."""
        self.failure: Booleans = np.zeros(num_slots, dtype=bool)
        """(B,) whether the episode is lost for good (a cup that fell off the table); ends it, too."""
        self.outcome: Floats = np.zeros(num_slots)
        """(B,) the task's outcome quantity as it stands now; no part of the observation."""

    @abstractmethod
    def begin(self, slots: Slots, instances: Floats) -> None:
        """Put the scenes of `slots` (b,) at the start of `instances` (b, I), without a tool."""

    @abstractmethod
    def build(self, slots: Slots, designs: Floats) -> None:
        """Add the tools `designs` (b, D), in the design space's units, to the scenes."""

    @abstractmethod
    def step(self, slots: Slots, controls: Floats) -> None:
        """Advance `slots` by one control step with `controls` (b, C) in [-1, 1]; write state, reward and both ends."""

    def forget(self, slots: Slots) -> None:
        """Forget the last episodes of `slots` (b,): rewards, conditions, ends and outcomes. For `begin`."""
        for values in (self.reward, self.outcome, *self.reward_terms.values()):
            values[slots] = 0.0
        for flags in (self.success, self.failure, *self.conditions.values()):
            flags[slots] = False
        self.met_steps[slots] = 0

    def set_reward(self, slots: Slots, **terms: NDArray[np.floating[Any]] | float) -> None:
        """Reward `slots` (b,) by the sum of named terms, (b,) each, added up in the order given. For `step`."""
        total: NDArray[np.floating[Any]] | float = 0.0
        for index, (name, values) in enumerate(terms.items()):
            if name not in self.reward_terms:
                self.reward_terms[name] = np.zeros(self.num_slots)
            self.reward_terms[name][slots] = values
            total = values if index == 0 else total + values
        self.reward[slots] = total

    def set_success(self, slots: Slots, steps: int = 1, **conditions: Booleans) -> None:
        """Call `slots` (b,) solved once all named conditions, (b,) each, have held together for a while. For `step`.

        Args:
            slots: which took a control step.
            steps: control steps in a row for which the conditions must hold.
            conditions: whether each holds now.
        """
        met: Booleans = np.ones(len(slots), dtype=bool)
        for name, holds in conditions.items():
            if name not in self.conditions:
                self.conditions[name] = np.zeros(self.num_slots, dtype=bool)
            self.conditions[name][slots] = holds
            met &= holds
        self.met_steps[slots] = np.where(met, self.met_steps[slots] + 1, 0)
        self.success[slots] = self.met_steps[slots] >= steps

    def advance(self, slots: Slots) -> None:
        """Make the engine's own physics steps of one control step, and nothing else: the raw cost of a step.

        Raises:
            NotImplementedError: the task has no engine.
        """
        raise NotImplementedError

    def inspect(self, slot: int) -> Physics:
        """Return what the scene in `slot` looks like to someone who checks its physics; changes nothing.

        Raises:
            NotImplementedError: the task does not say.
        """
        raise NotImplementedError

    def tool_shapes(self, slot: int) -> tuple[ToolPart, ...]:
        """Return what the engine itself lets collide as the tool in `slot`, in the frame of the held point.

        Raises:
            NotImplementedError: the task does not say.
        """
        raise NotImplementedError

    @property
    def draws(self) -> bool:
        """Whether the task draws pictures."""
        return type(self).render is not Simulator.render

    def render(self, slot: int) -> Frame:
        """Return a picture of the scene in `slot`, (height, width, 3), in RGB; needs no display and changes nothing.

        Raises:
            NotImplementedError: the task draws no pictures.
        """
        raise NotImplementedError
