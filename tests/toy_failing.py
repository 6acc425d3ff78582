"""A study whose only method cannot train with some of the settings that are drawn."""

from __future__ import annotations

from toy_tuning import ToyAim

from codesign_bench.method import BatchReport
from codesign_bench.study import Study, Tuning

LONGEST = 0.5


class ToyFails(ToyAim):
    """A stick that must not be too long."""

    name = "toy_fails"

    def train(self, remaining_steps: int) -> BatchReport:
        """Refuse long sticks."""
        if self.config.length > LONGEST:
            raise RuntimeError("too long")
        return super().train(remaining_steps)


STUDY = Study(
    name="toy_failing",
    title="Toy failing",
    question="Which length works?",
    methods=("toy_fails",),
    tuning=Tuning(methods=("toy_fails",), tasks=("toy_reach",), settings=3, rungs=2, eta=3, seeds=(0,)),
)
