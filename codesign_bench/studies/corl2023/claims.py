"""The paper's claims, in the order of its sections; a new claim is one more entry.

Sentences are ours, close to the paper's; figures are named by their LaTeX labels.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import prod

from codesign_bench.claims import comparison, deployment, fine_tuning, tools, tradeoff, zero_shot
from codesign_bench.claims.claim import Claim
from codesign_bench.claims.statistics import run_command
from codesign_bench.studies.corl2023.members import OURS, PRIOR, SEEDS, SEEDS_FINE_TUNING, SHARED, STARTS, TASKS
from codesign_bench.studies.corl2023.protocol import PROTOCOL
from codesign_bench.studies.corl2023.real_robot import REAL_ROBOT

EFFICIENCY = "Evaluating sample efficiency; fig:sample_efficiency"
TOOLS = "Evaluating sample efficiency; fig:qualitative_tools"
ENVIRONMENTS = "Experiments, simulated environments; tab:real_exp for fetch cube"
ZERO_SHOT = "Generalization to unseen task variations, zero-shot; fig:interpolation_curve"
FINE_TUNING = "Generalization to unseen task variations, fine-tuning; fig:finetuning"
REAL = "Evaluation on a real robot; tab:real_exp, fig:detailed_other_inits_results"
TRADEOFF = "Trading off design and control complexity; fig:control_design_ratio"

FETCH = "fetch_cube"
LIFT = "lift_cup"
CATCH = "catch_balls"
FRACTIONS, ALPHAS = PROTOCOL.cutout_fractions, PROTOCOL.alphas
FEW_SEEDS = PROTOCOL.seeds_generalisation
LOOKS = 2
"""Comparisons of methods are judged with a first set of seeds and, where that leaves them undecided, once more with
additional ones (ours)."""
TOOLS_ON_THE_ARM = len(REAL_ROBOT.fetch_cube_starts)


def _listed(option: str, values: tuple[float, ...]) -> str:
    return f" --{option} {' '.join(f'{value:g}' for value in values)}"


ALL_METHODS = {task: run_command("all", task, SEEDS[task]) for task in TASKS}
SENSITIVITY = "codesign-bench plot design_sensitivity --results {results}"
CUTOUTS = run_command(OURS, FETCH, FEW_SEEDS, _listed("cutout", FRACTIONS))
TRADEOFFS = run_command(OURS, CATCH, FEW_SEEDS, _listed("alpha", ALPHAS))
FINE_TUNED = (
    run_command(OURS, FETCH, SEEDS_FINE_TUNING),
    run_command(OURS, FETCH, SEEDS_FINE_TUNING, _listed("finetune", STARTS)),
)
FROM_SCRATCH = (*FINE_TUNED, run_command(OURS, FETCH, SEEDS_FINE_TUNING, _listed("scratch", STARTS)))


def _against(baseline: str, final: str, faster: str) -> Iterator[Claim]:
    """Yield the claims that compare the paper's method with another method, per task and across tasks.

    A baseline with one tool for all goals loses if one tool does not serve them, and the scenes are chosen so.
    """
    one_tool = baseline in PRIOR
    yield Claim(
        f"final_return.all_tasks.{baseline}",
        f"across all tasks, {final} {baseline}",
        EFFICIENCY,
        comparison.ahead_across_tasks(TASKS, OURS, baseline, tuple(ALL_METHODS.values())),
        TASKS,
        check_of_scene=one_tool,
        looks=LOOKS,
    )
    for task in TASKS:
        yield Claim(
            f"final_return.{task}.{baseline}",
            f"on {task}, {final} {baseline}",
            EFFICIENCY,
            comparison.final_return_above(task, OURS, baseline, (ALL_METHODS[task],)),
            (task,),
            check_of_scene=one_tool,
            adds_seeds_of=(OURS, baseline),
            looks=LOOKS,
        )
    for task in TASKS:
        yield Claim(
            f"steps.{task}.{baseline}",
            f"on {task}, {faster} {baseline}",
            EFFICIENCY,
            comparison.sooner(task, OURS, baseline, (ALL_METHODS[task],)),
            (task,),
            check_of_scene=one_tool,
            looks=LOOKS,
        )


CLAIMS: tuple[Claim, ...] = (
    *(
        claim
        for baseline in PRIOR
        for claim in _against(
            baseline,
            final="the framework ends with a higher return than",
            faster="the framework learns in fewer samples than",
        )
    ),
    *_against(
        SHARED,
        final="separate designer and controller networks end with a higher return than",
        faster="separate designer and controller networks learn in fewer samples than",
    ),
    *(
        Claim(
            f"tools_vary.{task}",
            f"on {task}, one learned designer makes different tools for different goals",
            TOOLS,
            tools.tools_vary(task, OURS, (ALL_METHODS[task],)),
            (task,),
        )
        for task in TASKS
    ),
    *(
        Claim(
            f"no_single_tool.{task}",
            f"no single tool solves all instances of {task}",
            ENVIRONMENTS,
            tools.no_single_tool(task, (SENSITIVITY,)),
            (task,),
            check_of_scene=True,
        )
        for task in TASKS
    ),
    Claim(
        "zero_shot.close",
        "with a very small cutout region, unseen starts of the cube are handled like seen ones",
        ZERO_SHOT,
        zero_shot.small_cutout_costs_little(FETCH, OURS, min(FRACTIONS), CUTOUTS),
        (FETCH,),
    ),
    Claim(
        "zero_shot.falls",
        "as the cutout region grows, the return on unseen starts falls",
        ZERO_SHOT,
        zero_shot.cost_grows(FETCH, OURS, FRACTIONS, CUTOUTS),
        (FETCH,),
    ),
    Claim(
        "zero_shot.gently",
        "as the cutout region grows, the return on unseen starts falls gently",
        ZERO_SHOT,
        zero_shot.cost_grows_gently(FETCH, OURS, FRACTIONS, CUTOUTS),
        (FETCH,),
    ),
    Claim(
        "zero_shot.portion",
        "even with the largest cutout region, a significant portion of unseen starts is solved",
        ZERO_SHOT,
        zero_shot.portion_solved(FETCH, OURS, max(FRACTIONS), CUTOUTS),
        (FETCH,),
    ),
    Claim(
        "zero_shot.outside",
        "policies solve starts of the cube even outside the training region",
        ZERO_SHOT,
        zero_shot.outside_solved(FETCH, OURS, run_command(OURS, FETCH, FEW_SEEDS)),
        (FETCH,),
    ),
    *(
        Claim(
            f"fine_tuning.unsolved_before.{number}",
            f"start {number} of the four outside the training region is not solved zero-shot",
            FINE_TUNING,
            fine_tuning.most_fail_before(FETCH, OURS, number, FINE_TUNED),
            (FETCH,),
        )
        for number in STARTS
    ),
    *(
        Claim(
            f"fine_tuning.solved_after.{number}",
            f"start {number} of the four outside the training region is solved after fine-tuning",
            FINE_TUNING,
            fine_tuning.most_succeed_after(FETCH, OURS, number, FINE_TUNED),
            (FETCH,),
        )
        for number in STARTS
    ),
    *(
        Claim(
            f"fine_tuning.wins.{number}",
            f"on start {number} of the four, fine-tuning is more effective than learning from scratch",
            FINE_TUNING,
            fine_tuning.fine_tuning_ahead(FETCH, OURS, number, FROM_SCRATCH),
            (FETCH,),
        )
        for number in STARTS
    ),
    Claim(
        "tradeoff.ratio",
        "the ratio of design to control follows alpha",
        TRADEOFF,
        tradeoff.falls_with_alpha(CATCH, OURS, ALPHAS, tradeoff.RATIO, TRADEOFFS),
        (CATCH,),
    ),
    Claim(
        "tradeoff.ratio_in_order",
        "the ratio of design to control follows alpha at each of its four values",
        TRADEOFF,
        tradeoff.ratio_drops_each_time(CATCH, OURS, ALPHAS, TRADEOFFS),
        (CATCH,),
    ),
    Claim(
        "tradeoff.material",
        "a larger alpha makes tools of less material",
        TRADEOFF,
        tradeoff.falls_with_alpha(CATCH, OURS, ALPHAS, tradeoff.MATERIAL, TRADEOFFS),
        (CATCH,),
    ),
    Claim(
        "tradeoff.effort",
        "a smaller alpha, with its larger tools, needs less movement",
        TRADEOFF,
        tradeoff.rises_with_alpha(CATCH, OURS, ALPHAS, tradeoff.EFFORT, TRADEOFFS),
        (CATCH,),
    ),
    *(
        Claim(
            f"deployment.own_instance.{task}",
            f"on an arm, policies succeed on the instance of {task} that their tool was designed for",
            REAL,
            deployment.arm_keeps_what_training_solves(task, OURS, tools=TOOLS_ON_THE_ARM, trials=REAL_ROBOT.trials),
            (task,),
        )
        for task in (FETCH, LIFT)
    ),
    Claim(
        "deployment.grid",
        "on an arm, no tool solves the whole grid of the cube's starts",
        REAL,
        deployment.no_tool_solves_the_grid(FETCH, OURS, tools=TOOLS_ON_THE_ARM, starts=prod(REAL_ROBOT.grid_shape)),
        (FETCH,),
        check_of_scene=True,
    ),
)
