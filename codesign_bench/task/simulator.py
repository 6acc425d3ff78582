"""A batched simulator of one task, and the guarantees of its physics.

Shapes: `B` slots of a simulator, `b` the slots of a call, `I` instance, `S` state, `D` design, `C` control.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from codesign_bench.task.checks import NotCopied
from codesign_bench.task.sketch import Sketch
from codesign_bench.task.spaces import Booleans, Floats, Frame, Singles, Slots
from codesign_bench.task.tool import ToolPart


@dataclass(frozen=True)
class Physics:
    """Measurements of a scene for a check of its physics."""

    overlap: float
    """Deepest overlap of two bodies that should not overlap, m; 0 if there is none."""
    speed: float
    """Speed of the fastest body other than the tool, m/s."""
    contained: bool
    """Whether every body is on the correct side of every wall and floor (or where it could have fallen)."""


@dataclass(frozen=True)
class Soundness:
    """Guarantees of a task's physics for any design and any control; tests check them."""

    overlap: float
    """No two bodies overlap deeper than this, m."""
    speed: float
    """No body other than the tool is faster than this, m/s."""
    outcome_change: float
    """Halving the physics step changes the outcome of a scripted episode by less than this, in the outcome's unit.

    This holds for the median episode. Where contact is chaotic, it holds for the mean over instances instead, and a
    two-sample Kolmogorov-Smirnov test finds no difference between the distributions of outcomes.
    """
    start_overlap: float = 1e-3
    """Right after the design step, no tool overlaps anything deeper than this, m."""
    chaotic: bool = False
    """Whether rounding errors decide single episodes, because many bodies are in contact."""


class Simulator(NotCopied, ABC):
    """Many independent episodes of one task in one process; slot `i` holds one episode.

    A call changes only the slots that it is given. What happens in a slot depends only on the calls to this slot since
    its `begin`. An episode is therefore the same in any batch, and in a new simulator or a used one: simulators are
    reused. They cannot be copied or pickled.
    """

    def __init__(self, num_slots: int, state_size: int) -> None:
        self.num_slots = num_slots
        self.state: Singles = np.zeros((num_slots, state_size), dtype=np.float32)
        """(B, S) task state, written in place."""
        self.reward: Floats = np.zeros(num_slots)
        """(B,) reward of the last step."""
        self.reward_terms: dict[str, Floats] = {}
        """Name -> (B,): the terms that add up to the last step's reward, if the task names terms."""
        self.conditions: dict[str, Booleans] = {}
        """Name -> (B,): whether each condition of success holds now, if the task names conditions."""
        self.met_steps: Slots = np.zeros(num_slots, dtype=np.intp)
        """(B,) number of consecutive control steps, up to now, in which all conditions of success held."""
        self.success: Booleans = np.zeros(num_slots, dtype=bool)
        """(B,) whether the task is solved; ends the episode."""
        self.failure: Booleans = np.zeros(num_slots, dtype=bool)
        """(B,) whether the episode can no longer succeed (e.g. a cup fell off the table); ends the episode."""
        self.outcome: Floats = np.zeros(num_slots)
        """(B,) current value of the task's outcome; not part of the observation."""

    @abstractmethod
    def begin(self, slots: Slots, instances: Floats) -> None:
        """Put the scenes of `slots` (b,) at the start of `instances` (b, I), without a tool."""

    @abstractmethod
    def build(self, slots: Slots, designs: Floats) -> None:
        """Add the tools `designs` (b, D), in the design space's units, to the scenes."""

    @abstractmethod
    def step(self, slots: Slots, controls: Floats) -> None:
        """Advance `slots` by a control step with `controls` (b, C) in [-1, 1]; set state, reward, success, failure."""

    def forget(self, slots: Slots) -> None:
        """Clear rewards, conditions, success, failure and outcomes of `slots` (b,). For use in `begin`."""
        for values in (self.reward, self.outcome, *self.reward_terms.values()):
            values[slots] = 0.0
        for flags in (self.success, self.failure, *self.conditions.values()):
            flags[slots] = False
        self.met_steps[slots] = 0

    def set_reward(self, slots: Slots, **terms: NDArray[np.floating[Any]] | float) -> None:
        """Set the reward of `slots` (b,) to the sum of named terms, (b,) each, in this order. For use in `step`."""
        total: NDArray[np.floating[Any]] | float = 0.0
        for index, (name, values) in enumerate(terms.items()):
            if name not in self.reward_terms:
                self.reward_terms[name] = np.zeros(self.num_slots)
            self.reward_terms[name][slots] = values
            total = values if index == 0 else total + values
        self.reward[slots] = total

    def set_success(self, slots: Slots, steps: int = 1, **conditions: Booleans) -> None:
        """Mark `slots` (b,) as solved once all named conditions, (b,) each, have held long enough. For use in `step`.

        Args:
            slots: slots that took a control step.
            steps: consecutive control steps in which all conditions must hold.
            conditions: whether each condition holds now.
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
        """Take only the engine's physics steps of one control step, to measure the bare cost of a step.

        Raises:
            NotImplementedError: the task has no engine.
        """
        raise NotImplementedError

    def inspect(self, slot: int) -> Physics:
        """Return measurements of the scene in `slot` for a check of its physics; changes nothing.

        Raises:
            NotImplementedError: the task does not say.
        """
        raise NotImplementedError

    def tool_shapes(self, slot: int) -> tuple[ToolPart, ...]:
        """Return the tool's collision shapes in the engine for `slot`, in the frame of the held point.

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

    def sketch(self, slot: int) -> Sketch:
        """Return the scene in `slot` as data, for drawings outside of Python; changes nothing.

        Raises:
            NotImplementedError: the task does not say.
        """
        raise NotImplementedError
