"""What is a separate credit for the design worth, and does the answer depend on the architecture?

Two architectures (separate graph networks, one shared perceptron) times two credits (joint, as in the paper, and
separate, ours), on all six tasks. The seeds are tuning seeds: the outcome decides a default, and a seed that decides
one is never reported.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from codesign_bench.cell.axes import Axis
from codesign_bench.cell.variant import Value, Variant
from codesign_bench.study import Experiment, Grid, Study

if TYPE_CHECKING:
    from codesign_bench.claims.claim import Claim

METHODS = ("gnn_ppo", "shared_arch")
TASKS = ("push", "catch_balls", "scoop", "fetch_cube", "lift_cup", "scoop_3d")
CREDITS = ("joint", "separate")
SEEDS = (0, 1, 2)


class DesignCredit(Axis):
    """Learns the design step with the credit of this name."""

    name = "credit"
    kind = str
    metavar = "NAME"
    help = f"credit of the design step: {' or '.join(CREDITS)}"

    def overrides(self, value: Value) -> tuple[str, ...]:
        """Set the hyperparameter, which refuses an unknown name."""
        return (f"design_credit={value}",)


def claims() -> Sequence[Claim]:
    """Return the claims, which were written down before their results were seen.

    The first decides the default of `laptop` and `quick`, the same for every method: separate credit if it is
    contradicted, and the paper's joint credit otherwise.
    """
    from codesign_bench.claims.claim import Claim
    from codesign_bench.claims.variants import Contrast, variant_ahead, variant_helps_more

    joint, separate = (Variant.of(credit=name) for name in CREDITS)
    needs = "codesign-bench reproduce --study credit --out {results}{profile}"
    contrast = Contrast(TASKS, joint, separate, (needs,))
    own, shared = METHODS
    return [
        Claim(
            "joint.all_methods",
            "across tasks and architectures, joint credit ends with a higher return than separate credit",
            "ours",
            variant_ahead(contrast, METHODS),
            TASKS,
        ),
        *(
            Claim(
                f"joint.{method}",
                f"across tasks, {method} ends with a higher return with joint credit than with separate credit",
                "ours",
                variant_ahead(contrast, (method,)),
                TASKS,
            )
            for method in METHODS
        ),
        Claim(
            f"joint.{own}.{shared}",
            f"joint credit is worth more to {own} than to {shared}",
            "ours",
            variant_helps_more(contrast, own, shared),
            TASKS,
        ),
    ]


STUDY = Study(
    name="credit",
    title="What is a separate credit for the design worth?",
    question="Does a separate, undiscounted advantage for the design help, and does that depend on the architecture?",
    methods=METHODS,
    tasks=TASKS,
    experiments={
        "credit": Experiment(
            ("design_credit",),
            "ours",
            ((Grid(TASKS, METHODS, SEEDS, tuple(Variant.of(credit=name) for name in CREDITS)),),),
        ),
    },
    axes=(DesignCredit(),),
    claims=claims,
)
