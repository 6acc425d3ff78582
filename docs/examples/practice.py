"""The study of the tutorial: is one open-loop motion better when its candidates are judged on more instances?"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from codesign_bench.cell.axes import Axis
from codesign_bench.cell.variant import Value, Variant
from codesign_bench.study import FIRST_REPORTED_SEED, Experiment, Grid, Study

if TYPE_CHECKING:
    from codesign_bench.claims.claim import Claim

TASKS, METHOD = ("catch_balls",), "cma_es"
FEW, MANY = Variant.of(practice=1), Variant.of(practice=16)
SEEDS = tuple(range(FIRST_REPORTED_SEED, FIRST_REPORTED_SEED + 6))


class Practice(Axis):
    """Judges every candidate on so many instances."""

    name = "practice"
    kind = int
    help = "judge candidates on N instances"

    def overrides(self, value: Value) -> tuple[str, ...]:
        """Set the hyperparameter."""
        return (f"{METHOD}.episodes_per_candidate={value}",)


def claims() -> Sequence[Claim]:
    """Return the claim, written down before its results were seen."""
    from codesign_bench.claims.claim import Claim
    from codesign_bench.claims.variants import Contrast, variant_ahead

    contrast = Contrast(TASKS, MANY, FEW, ("codesign-bench reproduce --study practice --out {results}{profile}",))
    sentence = "on catch_balls, candidates that are judged on more instances end with a higher return"
    return [Claim("practice.many", sentence, "ours", variant_ahead(contrast, (METHOD,)), TASKS)]


STUDY = Study(
    name="practice",
    title="Does practice on more instances help?",
    question="Does one open-loop motion improve when every candidate is judged on 16 instances, not on one?",
    methods=(METHOD,),
    experiments={
        "practice": Experiment(("practice_curves",), "ours", ((Grid(TASKS, (METHOD,), SEEDS, (FEW, MANY)),),)),
    },
    axes=(Practice(),),
    claims=claims,
)
