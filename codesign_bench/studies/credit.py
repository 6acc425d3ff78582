"""What is a separate credit for the design worth, and does the answer depend on the architecture?

Two architectures (separate graph networks, one shared perceptron) times two credits (joint, as in the paper, and
separate, ours), on all six tasks. The seeds are tuning seeds: the outcome decides a default, and a seed that decides
one is never reported.
"""

from __future__ import annotations

from codesign_bench.cell.axes import Axis
from codesign_bench.cell.variant import Value, Variant
from codesign_bench.study import Experiment, Grid, Study

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


STUDY = Study(
    name="credit",
    title="What is a separate credit for the design worth?",
    question="Does a separate, undiscounted advantage for the design help, and does that depend on the architecture?",
    methods=METHODS,
    experiments={
        "credit": Experiment(
            ("design_credit",),
            "ours",
            ((Grid(TASKS, METHODS, SEEDS, tuple(Variant.of(credit=name) for name in CREDITS)),),),
        ),
    },
    axes=(DesignCredit(),),
)
