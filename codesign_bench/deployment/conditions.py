"""How a deployment may differ from training: the arm, what the policy sees and when, and other physics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codesign_bench.errors import UserError, unknown_name
from codesign_bench.task.robot import ARMS, PANDA


@dataclass(frozen=True)
class Conditions:
    """Of a set of trials; by default nothing but the arm differs."""

    arm: str = PANDA
    """One of `ARMS`."""
    observation_noise: float = 0.0
    """Standard deviation of every length that the policy sees, m, drawn anew in every control step."""
    latency: int = 0
    """Control steps by which the state that the policy sees is old."""
    friction: float = 0.0
    """Each trial multiplies the friction of loose bodies by a number drawn from 1 - this to 1 + this."""
    mass: float = 0.0
    """The same of their mass."""

    def check(self) -> None:
        """Refuse values that mean nothing.

        Raises:
            UserError: one of them is out of its range.
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
"""Of the paper's protocol (all ours).

2 mm is what AprilTags seen by cameras half a metre away give; one control step is 42 ms, about an image and its
processing; a fifth covers what plastics and printed walls differ in.
"""


@dataclass(frozen=True)
class Physics:
    """What one trial multiplies."""

    friction: float
    mass: float

    @classmethod
    def draw(cls, conditions: Conditions, rng: np.random.Generator) -> Physics:
        """Return the factors of a new trial."""
        friction, mass = (1.0 + share * rng.uniform(-1.0, 1.0) for share in (conditions.friction, conditions.mass))
        return cls(friction, mass)
