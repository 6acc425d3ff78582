"""What acts while a batch is collected, for learners of any kind.

Shapes: `S` slots of a batch, `b` slots that take a step at once, `O` observation, `D` design, `C` control, `Z` noise.

An on-policy learner samples its policy and reports log-probabilities as extras; an off-policy one reports nothing; one
that tries a population gives every slot its own candidate.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field

from codesign_bench.task import Singles, Slots


@dataclass(frozen=True)
class Sample:
    """Actions for slots that take a step at once, and what the learner wants to remember of how they were chosen."""

    actions: Singles
    """(b, D) designs or (b, C) controls; what lies outside [-1, 1] is stored as it is and clipped by the episode."""
    extras: Mapping[str, Singles] = field(default_factory=dict)
    """Name -> (b, ...), stored with the step under the same name."""


class Explorer(ABC):
    """Chooses designs and controls as a function of the observation and of standard-normal noise.

    The collector draws the noise: an action then depends on the random numbers of its own slot and step, not on which
    other slots are still playing.
    """

    def __init__(self, design_noise: int, control_noise: int) -> None:
        self.design_noise = design_noise
        """Z of a design step: 0 for an explorer that designs without chance."""
        self.control_noise = control_noise
        """Z of a control step."""

    @abstractmethod
    def sample_design(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Return designs for `slots` (b,) of the batch, which see `observation` (b, O), using `noise` (b, Z)."""

    @abstractmethod
    def sample_control(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Return controls for `slots` (b,) of the batch, which see `observation` (b, O), using `noise` (b, Z)."""


class FixedDesigns(Explorer):
    """Another explorer's controls with designs chosen beforehand, one for all episodes of a slot."""

    def __init__(self, explorer: Explorer, unit_designs: Singles) -> None:
        super().__init__(0, explorer.control_noise)
        self.explorer = explorer
        self.unit_designs = unit_designs
        """(S, D) in [-1, 1]."""

    def sample_design(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Return the slots' designs."""
        return Sample(self.unit_designs[slots])

    def sample_control(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Return the other explorer's controls."""
        return self.explorer.sample_control(slots, observation, noise)
