"""Run the cells that experiments of a study need, then plot, verify and report: `codesign-bench reproduce`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from rich.console import Console

from codesign_bench.cell.cell import resolve_cells, usable_cells
from codesign_bench.claims.verify import verify
from codesign_bench.console import Log, printer, tell_left_out
from codesign_bench.errors import UserError
from codesign_bench.figures.drawing import draw_figures
from codesign_bench.registry import names
from codesign_bench.report.page import write_report
from codesign_bench.storage.survey import lines, survey
from codesign_bench.study.experiment import stages_of
from codesign_bench.study.study import Study
from codesign_bench.sweep.runner import EXIT_ALL_DONE, dry_run, run_sweep

CLAIMS_FOLDER, REPORT_FILE = "claims", "report.html"
"""Next to the folder of figures."""
MOST_TIMED = 12
"""Kinds of cells that a dry run times, some seconds each: a study may have hundreds (ours)."""


def reproduce(
    study: Study,
    wanted: Sequence[str],
    *,
    profile: str,
    results: Path,
    figures: Path,
    console: Console,
    jobs: int | None = None,
    seeds: int | None = None,
    same_code: bool = False,
    only_plan: bool = False,
    tensorboard: bool = False,
) -> int:
    """Run the missing cells of `wanted`, measure, plot, verify and report; return 0, or 1 if a cell failed.

    With `only_plan`, nothing is run: every cell is listed, with the expected time of all of them together.

    Raises:
        UserError: bad input, or none of the figures can be drawn.
    """
    experiments, log = study.experiments_named(wanted), printer(console)
    code = EXIT_ALL_DONE
    log(f"reproducing {', '.join(experiments)} of {study.name} with the profile {profile}")
    stages = stages_of(list(experiments.values()), profile, seeds)
    usable = set(usable_cells((cell for cells in stages for cell in cells), log))
    stages = [cells for stage in stages if (cells := [cell for cell in stage if cell in usable])]
    together = resolve_cells([cell for cells in stages for cell in cells])
    if only_plan:
        return dry_run(together, results, console=console, jobs=jobs, same_code=same_code, most_timed=MOST_TIMED)
    measures = sum(len(experiment.measures) for experiment in experiments.values())
    log(
        f"{len(together)} cells in {len(stages)} stages, at most {sum(cell.config.run.steps for cell in together):,} "
        f"environment steps, then {measures} measurements; --dry-run lists them, with the expected time"
    )
    for cells in stages:
        outcome = run_sweep(
            resolve_cells(cells),
            results,
            console=console,
            jobs=jobs,
            same_code=same_code,
            tensorboard=tensorboard,
        )
        code = max(code, outcome)
    for name, experiment in experiments.items():
        for measure in experiment.measures:
            _attempt(f"measurement of {name}", partial(measure, results, profile, log), log)
    left_out = lines(results, survey(results))
    tell_left_out(left_out)
    known = names("paper_figs")
    shown = [name for experiment in experiments.values() for name in experiment.figures if name in known]
    drawn = [_attempt(name, partial(draw_figures, [name], results, figures, log), log) for name in shown]
    if not any(drawn):
        raise UserError(f"nothing can be drawn of {', '.join(experiments)}")
    plays = any(experiment.plays for experiment in experiments.values())
    claims = partial(verify, study, results, figures.parent / CLAIMS_FOLDER, console, measure=plays, left_out=left_out)
    _attempt("claims", claims, log)
    _attempt("report", partial(write_report, results, figures.parent / REPORT_FILE, log, study), log)
    return code


def _attempt(what: str, make: Callable[[], object], log: Log) -> bool:
    """Call `make`; if it fails, log why and continue. Return whether it succeeded."""
    try:
        make()
    except UserError as error:
        log(f"{what} left out: {error}")
        return False
    return True
