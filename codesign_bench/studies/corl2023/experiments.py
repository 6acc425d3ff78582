"""The paper's experiments as data: the cells of each, in order, with the paper's numbers of seeds, or more."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from codesign_bench.cell.cell import Cell
from codesign_bench.cell.variant import DEFAULT, Variant
from codesign_bench.console import Log
from codesign_bench.studies.corl2023.members import (
    METHODS,
    OURS,
    SEEDS,
    SEEDS_FINE_TUNING,
    SEEDS_ON_THE_ARM,
    STARTS,
    TASKS,
)
from codesign_bench.studies.corl2023.protocol import PROTOCOL
from codesign_bench.studies.corl2023.real_robot import REAL_ROBOT
from codesign_bench.study.experiment import Experiment, Grid

ALL_SEEDS = {task: tuple(range(count)) for task, count in SEEDS.items()}
FEW_SEEDS = tuple(range(PROTOCOL.seeds_generalisation))
ONE_SEED = (0,)
ON_AN_ARM = tuple(REAL_ROBOT.own_successes)


def sweep_the_baseline(results: Path, profile: str, log: Log) -> None:
    """Sweep the settings of the CMA-ES baseline unless `results` already has the table."""
    from codesign_bench.studies.corl2023.baseline_sweep import sweep_baseline  # needs joblib and a method

    sweep_baseline(results, profile, log)


def deploy(results: Path, profile: str, log: Log) -> None:
    """Play the paper's trials on the arm with every finished seed of our method.

    Trials in `results` are not played again.

    Raises:
        UserError: no seed is finished; the message names the experiment's first.
    """
    from codesign_bench.deployment.conditions import TRIAL
    from codesign_bench.deployment.deploy import Order
    from codesign_bench.deployment.deploy import deploy as play_trials
    from codesign_bench.deployment.tables import FOLDER, protocol_file
    from codesign_bench.storage.cells import find_cells
    from codesign_bench.storage.policies import policy_and_task

    for task_name in ON_AN_ARM:
        done = (cell.record for cell in find_cells(results) if cell.is_done and cell.has_policy)
        wanted = (task_name, OURS, DEFAULT)
        finished = {record.seed for record in done if (record.task, record.method, record.variant) == wanted}
        for seed in sorted(finished or ONE_SEED):
            if not (results / FOLDER / task_name / protocol_file(seed)).exists():
                cell = Cell(task_name, OURS, seed=seed, profile=profile)
                policy, task = policy_and_task(cell.folder(results), task_name)
                order = Order(TRIAL, protocol=True, gifs=False, policy_seed=seed)
                play_trials(task, policy, order, results, log, cell.name)


EXPERIMENTS: Mapping[str, Experiment] = {
    "task_gallery": Experiment(("task_gallery",), "section 'Experiments', figure of the tasks"),
    "hyperparameter_tables": Experiment(("hyperparameter_tables",), "appendix, tables of hyperparameters"),
    "design_sensitivity": Experiment(("design_sensitivity",), "ours: the premise of the tasks", plays=True),
    "learning_curves": Experiment(
        ("learning_curves", "learning_curves_iqm", "final_results"),
        "section 'Evaluating sample efficiency'",
        ((Grid(TASKS, METHODS, ALL_SEEDS),),),
    ),
    "qualitative_tools": Experiment(
        ("qualitative_tools",), "figure of tools over goals", ((Grid(TASKS, (OURS,), ONE_SEED),),)
    ),
    "timing_table": Experiment(
        ("timing_table",), "appendix 'Computational Resources'", ((Grid(("fetch_cube",), METHODS, ONE_SEED),),)
    ),
    "generalization": Experiment(
        ("generalization",),
        "section 'Generalization to unseen goals', zero-shot",
        (
            (
                Grid(
                    ("fetch_cube",),
                    (OURS,),
                    FEW_SEEDS,
                    tuple(Variant.of(cutout=fraction) for fraction in PROTOCOL.cutout_fractions),
                ),
            ),
        ),
        plays=True,
    ),
    "fine_tuning": Experiment(
        ("fine_tuning",),
        "section 'Generalization to unseen goals', fine-tuning",
        (
            (Grid(("fetch_cube",), (OURS,), tuple(range(SEEDS_FINE_TUNING))),),
            (
                Grid(
                    ("fetch_cube",),
                    (OURS,),
                    tuple(range(SEEDS_FINE_TUNING)),
                    (
                        *(Variant.of(finetune=number) for number in STARTS),
                        *(Variant.of(scratch=number) for number in STARTS),
                    ),
                ),
            ),
        ),
    ),
    "tradeoff": Experiment(
        ("tradeoff", "tradeoff_tools"),
        "section 'Trading off design and control complexity'",
        (
            (
                Grid(
                    ("catch_balls",),
                    (OURS,),
                    FEW_SEEDS,
                    tuple(Variant.of(alpha=alpha) for alpha in PROTOCOL.alphas),
                ),
            ),
        ),
    ),
    "deployment": Experiment(
        ("deployment",),
        "section 'Evaluation on a real robot'",
        ((Grid(ON_AN_ARM, (OURS,), tuple(range(SEEDS_ON_THE_ARM))),),),
        measures=(deploy,),
    ),
    "baseline_sweep": Experiment(
        ("baseline_sweep",), "appendix, table of baseline hyperparameters", measures=(sweep_the_baseline,)
    ),
}
"""By name, cheap ones first."""
