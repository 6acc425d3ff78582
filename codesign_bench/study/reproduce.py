"""Run what an experiment of the paper needs, then draw, verify and report it: `codesign-bench reproduce`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from rich.console import Console

from codesign_bench.cell.cell import Cell
from codesign_bench.claims.verify import verify
from codesign_bench.deployment.conditions import TRIAL
from codesign_bench.deployment.deploy import Order, deploy
from codesign_bench.deployment.tables import FOLDER, PROTOCOL_FILE
from codesign_bench.errors import UserError
from codesign_bench.figures.drawing import draw_figures
from codesign_bench.registry import names
from codesign_bench.report.page import write_report
from codesign_bench.storage.policies import policy_and_task
from codesign_bench.studies.corl2023.baseline_sweep import sweep_baseline
from codesign_bench.studies.corl2023.experiments import OURS, experiments_named, stages_of
from codesign_bench.sweep.runner import EXIT_ALL_DONE, run_sweep

PLAYED = ("design_sensitivity", "generalization")
"""Experiments whose claims are judged by playing finished policies and scripts besides."""
CLAIMS_FOLDER, REPORT_FILE = "claims", "report.html"
"""Beside the folder of figures."""


def reproduce(
    wanted: Sequence[str],
    *,
    profile: str,
    results: Path,
    figures: Path,
    console: Console,
    jobs: int | None = None,
    seeds: int | None = None,
) -> int:
    """Run the missing cells of `wanted`, draw, verify and report; return 0, or 1 if some cell failed.

    Raises:
        UserError: bad input, or nothing at all that can be drawn.
    """
    experiments = experiments_named(wanted)
    code = EXIT_ALL_DONE

    def say(line: str) -> None:
        console.print(line, markup=False, highlight=False, soft_wrap=True)

    def attempt(what: str, make: Callable[[], object]) -> bool:
        """Do it, or say why it cannot be done, and go on; return which."""
        try:
            make()
        except UserError as error:
            say(f"{what} left out: {error}")
            return False
        return True

    say(f"reproducing {', '.join(experiments)} with the profile {profile}")
    for cells in stages_of(list(experiments.values()), profile, seeds):
        if cells:
            code = max(code, run_sweep(cells, results, console=console, jobs=jobs))
    if any(experiment.sweeps for experiment in experiments.values()):
        sweep_baseline(results, profile, say)
    for task in (task for experiment in experiments.values() for task in experiment.deploys):
        attempt(f"trials of {task} on an arm", partial(_deploy_once, task, profile, results, say))
    figures_known = names("paper_figs")
    shown = [name for experiment in experiments.values() for name in experiment.figures if name in figures_known]
    drawn = [attempt(name, partial(draw_figures, [name], results, figures, say)) for name in shown]
    if not any(drawn):
        raise UserError(f"nothing can be drawn of {', '.join(experiments)}")
    plays = not experiments.keys().isdisjoint(PLAYED)
    attempt("claims", partial(verify, results, figures.parent / CLAIMS_FOLDER, console, measure=plays))
    attempt("report", partial(write_report, results, figures.parent / REPORT_FILE, say))
    return code


def _deploy_once(task_name: str, profile: str, results: Path, say: Callable[[str], None]) -> None:
    """Play the paper's trials of our method's first seed on the arm, unless `results` holds some already.

    Raises:
        UserError: the seed's cell is not done.
    """
    if (results / FOLDER / task_name / PROTOCOL_FILE).exists():
        return
    folder = Cell(task_name, OURS, seed=0, profile=profile).folder(results)
    policy, task = policy_and_task(folder, task_name)
    deploy(task, policy, Order(TRIAL, protocol=True, gifs=False), results, say, str(folder))
