"""The study of the paper: "Learning to Design and Use Tools for Robotic Manipulation" (Liu et al., CoRL 2023).

`scenes.py`, `learners.py`, `protocol.py` and `real_robot.py` have every number that the paper prints, `members.py` the
names of its tasks and methods, `profile.py` its hyperparameters as a profile, `experiments.py` the cells that its
figures need, `claims.py` its findings, `baseline_sweep.py` and `hyperparameters.py` what two tables are drawn from.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from codesign_bench.studies.corl2023.experiments import EXPERIMENTS
from codesign_bench.studies.corl2023.members import METHODS, TASKS
from codesign_bench.studies.corl2023.profile import PAPER
from codesign_bench.study.study import Study
from codesign_bench.study.tuning import Tuning

if TYPE_CHECKING:
    from codesign_bench.claims.claim import Claim


def claims() -> Sequence[Claim]:
    """Return the paper's claims, in the order of its sections."""
    from codesign_bench.studies.corl2023.claims import CLAIMS  # needs pandas and scipy; listing does not

    return CLAIMS


STUDY = Study(
    name="corl2023",
    title="Learning to Design and Use Tools for Robotic Manipulation",
    question="Does a designer that sees the goal, trained together with a controller, beat one tool for all goals?",
    source="Liu, Tian, Guo, Liu, Wu; CoRL 2023",
    methods=METHODS,
    tasks=TASKS,
    experiments=EXPERIMENTS,
    claims=claims,
    profiles=(PAPER,),
    tuning=Tuning(methods=METHODS, tasks=TASKS, settings=18, rungs=3, eta=3, seeds=(0, 1)),
)
