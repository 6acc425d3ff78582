"""Does a tool for each goal also win on tasks that the paper does not have?

The paper's five methods on the tasks beyond the paper's, with other design spaces and other goals.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from codesign_bench.study import FIRST_REPORTED_SEED, Experiment, Grid, Study

if TYPE_CHECKING:
    from codesign_bench.claims.claim import Claim

METHODS = ("gnn_ppo", "shared_arch", "cma_rl", "hwasp_minimal", "cma_es")
OURS, OTHERS = METHODS[0], METHODS[1:]
ONE_TOOL = METHODS[2:]
"""Methods that design one tool for all goals."""
TASKS = ("bounce", "gather")
SEEDS = tuple(range(FIRST_REPORTED_SEED, FIRST_REPORTED_SEED + 6))
"""Above those of any tuning, as settings may have been tried on these tasks."""
SENSITIVITY = "codesign-bench plot design_sensitivity --study further_tasks --results {results}"
NEEDS = ("codesign-bench reproduce --study further_tasks --out {results}{profile}",)


def claims() -> Sequence[Claim]:
    """Return the claims, which were written down before any result was seen."""
    from codesign_bench.claims import comparison, tools
    from codesign_bench.claims.claim import Claim

    return [
        *(
            Claim(
                f"no_single_tool.{task}",
                f"on {task}, no single tool solves every goal that some tool solves",
                "ours",
                tools.no_single_tool(task, (SENSITIVITY,)),
                (task,),
                check_of_scene=True,
            )
            for task in TASKS
        ),
        *(
            Claim(
                f"tools_vary.{task}",
                f"on {task}, one learned designer makes different tools for different goals",
                "ours",
                tools.tools_vary(task, OURS, NEEDS),
                (task,),
            )
            for task in TASKS
        ),
        *(
            Claim(
                f"final_return.{task}.{other}",
                f"on {task}, {OURS} ends with a higher return than {other}",
                "ours",
                comparison.final_return_above(task, OURS, other, NEEDS),
                (task,),
                check_of_scene=other in ONE_TOOL,
            )
            for task in TASKS
            for other in OTHERS
        ),
    ]


STUDY = Study(
    name="further_tasks",
    title="Does a tool for each goal also win on tasks that the paper does not have?",
    question="Do the paper's methods rank alike where a shape has to bring several bodies to one place?",
    methods=METHODS,
    tasks=TASKS,
    experiments={
        "task_gallery": Experiment(("task_gallery",), "ours"),
        "design_sensitivity": Experiment(("design_sensitivity",), "ours", plays=True),
        "learning_curves": Experiment(("learning_curves", "final_results"), "ours", ((Grid(TASKS, METHODS, SEEDS),),)),
    },
    claims=claims,
)
