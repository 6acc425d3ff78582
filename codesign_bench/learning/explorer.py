"""The interface for choosing actions while a batch is collected, for any kind of learner.

Shapes: `S` slots of a batch, `b` slots that take a step at once, `O` observation, `D` design, `C` control, `Z` noise,
`E` episodes of a slot, `I` instance.

An on-policy learner samples its policy and stores log-probabilities as extras; an off-policy learner stores none; a
population-based learner gives every slot its own candidate.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtr

from codesign_bench.task import Floats, Singles, Slots


@dataclass(frozen=True)
class Sample:
    """Actions for slots that step together, and values that the learner wants to store with them."""

    actions: Singles
    """(b, D) designs or (b, C) controls; values outside [-1, 1] are stored unclipped, and clipped by the episode."""
    extras: Mapping[str, Singles] = field(default_factory=dict)
    """Name -> (b, ...), stored with the step under this name."""


class Explorer(ABC):
    """Chooses designs and controls as functions of the observation and of standard-normal noise.

    The collector draws the noise, so that an action depends only on the random numbers of its slot and step, not on
    which other slots are still running.
    """

    def __init__(self, design_noise: int, control_noise: int) -> None:
        self.design_noise = design_noise
        """Z of a design step; 0 for deterministic designs."""
        self.control_noise = control_noise
        """Z of a control step."""

    @abstractmethod
    def sample_design(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Return designs for `slots` (b,) of the batch from `observation` (b, O) and `noise` (b, Z)."""

    @abstractmethod
    def sample_control(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Return controls for `slots` (b,) of the batch from `observation` (b, O) and `noise` (b, Z)."""

    def instances(self, slots: Slots, episode: Slots) -> Floats | None:
        """Return the instances (b, I) of the episodes numbered `episode` (b,) of their slots; None: draw them."""
        return None


@dataclass(frozen=True)
class Trial:
    """What a batch tries: one design for all episodes of a slot, and perhaps the instances to try it on."""

    unit_designs: Singles
    """(S, D) in [-1, 1]."""
    instances: Floats | None = None
    """(S, E, I), taken in turn by a slot's episodes; None: each episode draws its own."""


class FixedDesigns(Explorer):
    """Another explorer's controls with designs, and perhaps instances, chosen before the batch."""

    def __init__(self, explorer: Explorer, trial: Trial) -> None:
        super().__init__(0, explorer.control_noise)
        self.explorer, self.trial = explorer, trial

    def sample_design(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Return the slots' designs."""
        return Sample(self.trial.unit_designs[slots])

    def instances(self, slots: Slots, episode: Slots) -> Floats | None:
        """Return the instances that were chosen, from the first again after the last."""
        chosen = self.trial.instances
        return None if chosen is None else chosen[slots, episode % chosen.shape[1]]

    def sample_control(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Return the other explorer's controls."""
        return self.explorer.sample_control(slots, observation, noise)


class UniformDesigns(Explorer):
    """Another explorer's controls with a design for each episode that is drawn uniformly from [-1, 1]^D."""

    def __init__(self, explorer: Explorer) -> None:
        super().__init__(explorer.design_noise, explorer.control_noise)
        self.explorer = explorer

    def sample_design(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Return the designs (b, D) that standard-normal `noise` (b, D) stands for."""
        # The distribution function of the noise is uniform on [0, 1].
        return Sample((2.0 * ndtr(noise) - 1.0).astype(np.float32))

    def sample_control(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Return the other explorer's controls."""
        return self.explorer.sample_control(slots, observation, noise)
