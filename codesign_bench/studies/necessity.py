"""Is a tool per goal needed? Is reinforcement learning? Is co-design needed at all?

Each question is asked by two methods that differ in the thing asked about and in as little else as possible. All have
the same budget. Seeds are above those of any tuning.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from codesign_bench.study import FIRST_REPORTED_SEED, Experiment, Grid, Study

if TYPE_CHECKING:
    from codesign_bench.claims.claim import Claim


@dataclass(frozen=True)
class Question:
    """Two methods, and what a difference between them would mean."""

    name: str
    with_it: str
    """The method that has what is asked about."""
    without: str
    """The method that lacks it."""
    means: str
    """What it means if the first ends higher."""


QUESTIONS = (
    Question(
        "tool_per_goal.search",
        "contextual_cma",
        "cma_rl",
        "a search for a tool per goal beats the search for one tool, with the same learner of control",
    ),
    Question(
        "tool_per_goal.plans",
        "pt_me",
        "cma_es",
        "an archive of tools and plans per goal beats the search for one tool and one plan",
    ),
    Question(
        "learned_designs",
        "gnn_ppo",
        "contextual_cma",
        "designs learned by policy gradient beat designs searched per goal, each with a learned controller",
    ),
    Question(
        "learning",
        "gnn_ppo",
        "pt_me",
        "learning designer and controller beats an archive of tools and open-loop plans",
    ),
    Question(
        "co_design.one_tool",
        "hwasp_minimal",
        "fixed_tool",
        "learning one tool and its control beats learning control of a good tool that is given",
    ),
    Question(
        "co_design.tool_per_goal",
        "gnn_ppo",
        "fixed_tool",
        "learning a tool per goal and its control beats learning control of a good tool that is given",
    ),
    Question(
        "given_tool",
        "fixed_tool",
        "random_tool",
        "control of a good tool beats control of the middle one that was learned with random tools",
    ),
)
METHODS = tuple(dict.fromkeys(name for question in QUESTIONS for name in (question.with_it, question.without)))
TASKS = ("push", "catch_balls", "scoop", "fetch_cube", "lift_cup", "scoop_3d")
FIVE, THREE = (tuple(range(FIRST_REPORTED_SEED, FIRST_REPORTED_SEED + count)) for count in (5, 3))
SEEDS = {task: FIVE if task in ("push", "catch_balls", "fetch_cube") else THREE for task in TASKS}
"""Where a cell is short, five; three suffice across tasks."""
NEEDS = ("codesign-bench reproduce --study necessity --out {results}{profile}",)


def claims() -> Sequence[Claim]:
    """Return the claims, written down before their results were seen: each question across tasks, then on each task.

    Each asks whether the method that has something ends higher than the one without it. If a claim is not supported,
    nothing shows that it is needed; if contradicted, one does better without it.
    """
    from codesign_bench.claims.claim import Claim
    from codesign_bench.claims.comparison import ahead_across_tasks, final_return_above

    across = [
        Claim(
            f"{question.name}.all_tasks",
            f"across tasks, {question.means} ({question.with_it} against {question.without})",
            "ours",
            ahead_across_tasks(TASKS, question.with_it, question.without, NEEDS),
            TASKS,
        )
        for question in QUESTIONS
    ]
    on_each = [
        Claim(
            f"{question.name}.{task}",
            f"on {task}, {question.means} ({question.with_it} against {question.without})",
            "ours",
            final_return_above(task, question.with_it, question.without, NEEDS),
            (task,),
        )
        for question in QUESTIONS
        for task in TASKS
    ]
    return [*across, *on_each]


STUDY = Study(
    name="necessity",
    title="What is needed: a tool per goal, reinforcement learning, co-design?",
    question="Which part of learning to design and use tools earns its cost, and which would a simpler method replace?",
    methods=METHODS,
    tasks=TASKS,
    experiments={
        "necessity": Experiment(("learning_curves", "final_results"), "ours", ((Grid(TASKS, METHODS, SEEDS),),)),
    },
    claims=claims,
)
