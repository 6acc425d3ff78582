"""Behaviours without training: fixed designs, random tools and controls, an idle tool, and two behaviours joined.

Shapes: `B` batch, `O` observation, `D` design, `C` control.
"""

from __future__ import annotations

import numpy as np

from codesign_bench.task.behaviour import Behaviour
from codesign_bench.task.spaces import Floats, Singles
from codesign_bench.task.task import Task


class GivenDesigns(Behaviour):
    """A controller with fixed designs: one per episode, or the same for all."""

    def __init__(self, unit_designs: Floats | Singles, controller: Behaviour) -> None:
        """Take designs in [-1, 1]: (B, D) for B parallel episodes, or one design (D,) for any number of episodes."""
        self.unit_designs, self.controller = unit_designs.astype(np.float32), controller

    def design(self, observation: Singles) -> Singles:
        """Return the fixed designs (B, D); the observation is ignored."""
        return np.broadcast_to(self.unit_designs, (*observation.shape[:-1], self.unit_designs.shape[-1]))

    def act(self, observation: Singles) -> Singles:
        """Return the controller's control."""
        return self.controller.act(observation)


class Idle(Behaviour):
    """The tool at the centre of the design space, held still."""

    def __init__(self, task: Task) -> None:
        self.sizes = task.design_space.size, task.control_space.size

    def design(self, observation: Singles) -> Singles:
        """Return (B, D) zeros."""
        return np.zeros((*np.shape(observation)[:-1], self.sizes[0]), dtype=np.float32)

    def act(self, observation: Singles) -> Singles:
        """Return (B, C) zeros."""
        return np.zeros((*np.shape(observation)[:-1], self.sizes[1]), dtype=np.float32)


class Joined(Behaviour):
    """The designer of one behaviour with the controller of another."""

    def __init__(self, designer: Behaviour, controller: Behaviour) -> None:
        self.designer, self.controller = designer, controller

    def design(self, observation: Singles) -> Singles:
        """Return the designer's designs."""
        return self.designer.design(observation)

    def act(self, observation: Singles) -> Singles:
        """Return the controller's controls."""
        return self.controller.act(observation)


class RandomBehaviour(Behaviour):
    """Uniformly random tools, with random controls that are held for a few steps so that the tool covers distance."""

    HELD_STEPS = 10

    def __init__(self, task: Task, rng: np.random.Generator) -> None:
        self.task, self.rng = task, rng
        self._control: Singles = np.zeros((0, task.control_space.size), dtype=np.float32)
        self._steps = 0

    def design(self, observation: Singles) -> Singles:
        """Return random designs."""
        return self._uniform(observation, self.task.design_space.size)

    def act(self, observation: Singles) -> Singles:
        """Return random controls, redrawn every `HELD_STEPS` steps."""
        if self._steps % self.HELD_STEPS == 0 or len(self._control) != len(observation):
            self._control = self._uniform(observation, self.task.control_space.size)
        self._steps += 1
        return self._control

    def _uniform(self, observation: Singles, size: int) -> Singles:
        return self.rng.uniform(-1.0, 1.0, size=(*observation.shape[:-1], size)).astype(np.float32)
