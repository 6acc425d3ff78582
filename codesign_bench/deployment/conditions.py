"""Differences between deployment and training: arm, observation noise, latency and physics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codesign_bench.errors import UserError, unknown_name
from codesign_bench.task.robot import ARMS, PANDA


@dataclass(frozen=True)
class Conditions:
    """Conditions of a set of trials; by default only the arm differs from training."""

    arm: str = PANDA
    """One of `ARMS`."""
    observation_noise: float = 0.0
    """Standard deviation of the noise on every observed length, m, redrawn in every control step."""
    latency: int = 0
    """Delay of the observed state, control steps."""
    friction: float = 0.0
    """Each trial multiplies the friction of loose bodies by a factor drawn from [1 - this, 1 + this]."""
    mass: float = 0.0
    """The same for their mass."""

    def check(self) -> None:
        """Check that all values are valid.

        Raises:
            UserError: a value is out of range.
        """
        if self.arm not in ARMS:
            raise unknown_name("arm", self.arm, ARMS)
        if not 0.0 <= self.observation_noise < 1.0:
            raise UserError(f"--observation-noise must be from 0 to below 1 (m), not {self.observation_noise}")
        if self.latency < 0:
            raise UserError(f"--latency must be 0 control steps or more, not {self.latency}")
        for name, share in (("friction", self.friction), ("mass", self.mass)):
            if not 0.0 <= share < 1.0:
                raise UserError(f"--{name} must be from 0 to below 1, not {share}")


TRIAL = Conditions(observation_noise=0.002, latency=1, friction=0.2, mass=0.2)
"""Conditions of the paper's protocol (all ours).

2 mm is the accuracy of AprilTags at a distance of half a metre; one control step, 42 ms, is about the time for an image
and its processing; a fifth covers the differences between plastics and printed walls.
"""


@dataclass(frozen=True)
class Physics:
    """Factors of one trial on friction and mass."""

    friction: float
    mass: float

    @classmethod
    def draw(cls, conditions: Conditions, rng: np.random.Generator) -> Physics:
        """Return the factors of a new trial."""
        friction, mass = (1.0 + share * rng.uniform(-1.0, 1.0) for share in (conditions.friction, conditions.mass))
        return cls(friction, mass)
