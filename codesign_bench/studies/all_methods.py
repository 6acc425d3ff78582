"""How do all methods compare, the paper's and the others, when each has had the same search for its settings?

The question is open, so there are no claims: what is seen here becomes a claim of a later study, on other seeds.
"""

from __future__ import annotations

from codesign_bench.registry import built_in
from codesign_bench.study import FIRST_REPORTED_SEED, Experiment, Grid, Study, Tuning

METHODS, TASKS = built_in("methods"), built_in("tasks")
SEEDS = tuple(range(FIRST_REPORTED_SEED, FIRST_REPORTED_SEED + 3))

STUDY = Study(
    name="all_methods",
    title="All methods, with settings from one search",
    question="How do all methods compare, when each has had the same search for its settings?",
    methods=METHODS,
    tasks=TASKS,
    experiments={
        "all_methods": Experiment(("learning_curves", "final_results"), "ours", ((Grid(TASKS, METHODS, SEEDS),),)),
    },
    # Thirteen methods on eight tasks: a random search over whole ranges would take more than a hundred core-hours.
    # Three changes of each method's settings are compared with none, on all tasks together, at a quarter of the budget.
    tuning=Tuning(
        methods=METHODS,
        tasks=TASKS,
        settings=4,
        rungs=1,
        seeds=(0,),
        spread=0.5,
        share=0.25,
        pooled=True,
        ahead_on=len(TASKS) - 1,
    ),
)
