"""A study in one file: its question, the cells that answer it, an axis that they vary, a figure, and a claim."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from codesign_bench.cell.axes import Axis
from codesign_bench.cell.variant import Value, Variant
from codesign_bench.study import FIRST_REPORTED_SEED, Experiment, Grid, Study, Tuning

if TYPE_CHECKING:
    import numpy as np

    from codesign_bench.claims.claim import Claim
    from codesign_bench.claims.evidence import Evidence
    from codesign_bench.claims.finding import Finding

TASK, METHOD = "reach", "random_search"
SEEDS = tuple(range(FIRST_REPORTED_SEED, FIRST_REPORTED_SEED + 3))
LEAST = 0.1
"""Smallest correlation that counts."""


class Practice(Axis):
    """Judges all candidates of the search on so many instances."""

    name = "practice"
    kind = int
    help = "judge candidates of the random search on N instances"

    def overrides(self, value: Value) -> tuple[str, ...]:
        """Set the hyperparameter of this name."""
        return (f"{METHOD}.practice={value}",)


def lengths_follow_goals(evidence: Evidence, rng: np.random.Generator) -> Finding:
    """Judge by the correlation of lengths and distances over evaluation instances, seed by seed.

    Raises:
        InsufficientData: there are fewer than three finished seeds.
    """
    from codesign_bench.claims.finding import Finding, above
    from codesign_bench.stats import one_sample_t

    del rng  # nothing is drawn
    rows = evidence.instances(TASK, METHOD)
    found = [part["design_length"].corr(part["instance_goal_distance"]) for _, part in rows.groupby("seed", sort=True)]
    mean = one_sample_t(found)
    return Finding(above(mean, least=LEAST), mean.value, mean.low, mean.high, n=f"{len(found)} seeds", p=mean.p)


def claims() -> Sequence[Claim]:
    """Return the one claim."""
    from codesign_bench.claims.claim import Claim, Rule

    rule = Rule(
        "lengths follow goals",
        "correlation of length and distance, mean over seeds",
        f"supported if the 95 % t interval over seeds lies above 0 and the mean is at least {LEAST:g}, "
        "contradicted if the same holds below 0",
        ("codesign-bench reproduce --study fitting_lengths --out {results}{profile}",),
        lengths_follow_goals,
    )
    return [Claim("lengths.reach", "On reach, farther goals get longer links.", "ours", rule, tasks=(TASK,))]


STUDY = Study(
    name="fitting_lengths",
    title="Do designed lengths fit their goals?",
    question="Does a farther goal get a longer link, and does practice on more instances help?",
    methods=(METHOD,),
    experiments={
        "lengths": Experiment(("tool_lengths",), "ours", ((Grid((TASK,), (METHOD,), SEEDS),),)),
        "practice": Experiment(
            ("learning_curves",),
            "ours",
            ((Grid((TASK,), (METHOD,), SEEDS, (Variant.of(practice=1), Variant.of(practice=64))),),),
        ),
    },
    claims=claims,
    axes=(Practice(),),
    tuning=Tuning(methods=(METHOD, "sac"), tasks=(TASK,), settings=9, rungs=2, eta=3, seeds=(0, 1)),
)
