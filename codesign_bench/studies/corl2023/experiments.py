"""The paper's experiments as data: which cells each of them needs, in which order.

An experiment that needs no cells is drawn from the code itself or from measurements that `plot` makes. The numbers of
seeds are the paper's; the profiles `laptop` and `quick` may take fewer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from codesign_bench.cell.cell import Cell, grid
from codesign_bench.errors import unknown_name
from codesign_bench.studies.corl2023.protocol import PROTOCOL
from codesign_bench.studies.corl2023.real_robot import REAL_ROBOT
from codesign_bench.studies.corl2023.scenes import SCENES

OURS = "gnn_ppo"
"""The paper's own method."""
BASELINES = ("shared_arch", "cma_rl", "hwasp_minimal", "cma_es")
MOST_SEEDS = {"quick": 1}
"""Most seeds of a cell in a profile; the paper's number elsewhere."""


@dataclass(frozen=True)
class Grid:
    """Cells of an experiment: tasks x methods x variants x seeds."""

    tasks: tuple[str, ...]
    methods: tuple[str, ...] = (OURS,)
    seeds: int | None = None
    """The paper's number of seeds; None: that of its learning curves, task by task."""
    cutouts: tuple[float, ...] = ()
    alphas: tuple[float, ...] = ()
    finetunes: tuple[int, ...] = ()
    scratches: tuple[int, ...] = ()
    overrides: tuple[str, ...] = ()
    """Settings otherwise than the profile's, as `--set` takes them."""

    def cells(self, profile: str, seeds: int | None = None) -> list[Cell]:
        """Return the cells under a profile; `seeds` overrides their number."""
        found: list[Cell] = []
        for task in self.tasks:
            paper = PROTOCOL.seeds_for(task) if self.seeds is None else self.seeds
            count = min(paper, MOST_SEEDS.get(profile, paper)) if seeds is None else seeds
            found += grid(
                tasks=[task],
                methods=self.methods,
                seeds=range(count),
                cutouts=self.cutouts,
                alphas=self.alphas,
                finetunes=self.finetunes,
                scratches=self.scratches,
                profile=profile,
                overrides=self.overrides,
            )
        return found


@dataclass(frozen=True)
class Experiment:
    """What one figure or table needs."""

    figures: tuple[str, ...]
    """Files in `paper_figs/`."""
    section: str
    """Where the paper tells of it."""
    stages: tuple[tuple[Grid, ...], ...] = ()
    """Grids to run, one stage after the other; a later stage may go on from cells of an earlier one."""
    sweeps: bool = False
    """Whether it needs the sweep of the baseline's hyperparameters."""
    deploys: tuple[str, ...] = ()
    """Tasks whose policy, the first seed of our method, plays the trials on the arm."""


ALL_TASKS = tuple(SCENES)
FEWER = PROTOCOL.seeds_generalisation
ON_AN_ARM = tuple(REAL_ROBOT.own_successes)
STARTS = tuple(range(1, 1 + len(PROTOCOL.fine_tuning_starts)))

EXPERIMENTS: dict[str, Experiment] = {
    "task_gallery": Experiment(("task_gallery",), "section 'Experiments', figure of the tasks"),
    "hyperparameter_tables": Experiment(("hyperparameter_tables",), "appendix, tables of hyperparameters"),
    "design_sensitivity": Experiment(("design_sensitivity",), "ours: the premise of the tasks"),
    "learning_curves": Experiment(
        ("learning_curves", "learning_curves_iqm", "final_results"),
        "section 'Evaluating sample efficiency'",
        ((Grid(ALL_TASKS, (OURS, *BASELINES)),),),
    ),
    "qualitative_tools": Experiment(
        ("qualitative_tools",), "figure of tools over goals", ((Grid(ALL_TASKS, seeds=1),),)
    ),
    "timing_table": Experiment(
        ("timing_table",),
        "appendix 'Computational Resources'",
        ((Grid(("fetch_cube",), (OURS, *BASELINES), seeds=1),),),
    ),
    "generalization": Experiment(
        ("generalization",),
        "section 'Generalization to unseen goals', zero-shot",
        ((Grid(("fetch_cube",), seeds=FEWER, cutouts=PROTOCOL.cutout_fractions),),),
    ),
    "fine_tuning": Experiment(
        ("fine_tuning",),
        "section 'Generalization to unseen goals', fine-tuning",
        (
            (Grid(("fetch_cube",), seeds=FEWER),),
            (Grid(("fetch_cube",), seeds=FEWER, finetunes=STARTS, scratches=STARTS),),
        ),
    ),
    "tradeoff": Experiment(
        ("tradeoff", "tradeoff_tools"),
        "section 'Trading off design and control complexity'",
        ((Grid(("catch_balls",), seeds=FEWER, alphas=PROTOCOL.alphas),),),
    ),
    "deployment": Experiment(
        ("deployment",),
        "section 'Evaluation on a real robot'",
        ((Grid(ON_AN_ARM, seeds=1),),),
        deploys=ON_AN_ARM,
    ),
    "baseline_sweep": Experiment(("baseline_sweep",), "appendix, table of baseline hyperparameters", sweeps=True),
}
"""By name, cheap ones first."""


def experiments_named(names: Sequence[str]) -> dict[str, Experiment]:
    """Return the experiments that `names` mean: their own names or those of figures; none or `all` means every one.

    Raises:
        UserError: an unknown name.
    """
    if not names or "all" in names:
        return dict(EXPERIMENTS)
    of_figure = {figure: name for name, experiment in EXPERIMENTS.items() for figure in experiment.figures}
    known = of_figure | {name: name for name in EXPERIMENTS}
    for name in names:
        if name not in known:
            raise unknown_name("experiment", name, (*dict.fromkeys([*EXPERIMENTS, *of_figure]), "all"))
    return {known[name]: EXPERIMENTS[known[name]] for name in names}


def stages_of(experiments: Sequence[Experiment], profile: str, seeds: int | None = None) -> list[list[Cell]]:
    """Return the cells of several experiments, each once, stage by stage."""
    stages: list[list[Cell]] = []
    for index in range(max((len(experiment.stages) for experiment in experiments), default=0)):
        before = {cell for stage in stages for cell in stage}
        cells = [
            cell
            for experiment in experiments
            if index < len(experiment.stages)
            for part in experiment.stages[index]
            for cell in part.cells(profile, seeds)
        ]
        stages.append([cell for cell in dict.fromkeys(cells) if cell not in before])
    return stages
