"""Run what an experiment of the paper needs, then draw, verify and report it: `codesign-bench reproduce`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from codesign_bench.baseline_sweep import sweep_baseline
from codesign_bench.claims.verify import verify
from codesign_bench.errors import UserError
from codesign_bench.experiments import experiments_named, stages_of
from codesign_bench.plotting import draw_figures
from codesign_bench.registry import names
from codesign_bench.report.page import write_report
from codesign_bench.runner import EXIT_ALL_DONE, run_sweep

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

    say(f"reproducing {', '.join(experiments)} with the profile {profile}")
    for cells in stages_of(list(experiments.values()), profile, seeds):
        if cells:
            code = max(code, run_sweep(cells, results, console=console, jobs=jobs))
    if any(experiment.sweeps for experiment in experiments.values()):
        sweep_baseline(results, profile, say)
    figures_known = names("paper_figs")
    for name in (name for experiment in experiments.values() for name in experiment.figures):
        if name in figures_known:
            try:
                draw_figures([name], results, figures, say)
            except UserError as error:
                say(f"{name} left out: {error}")
    plays = not experiments.keys().isdisjoint(PLAYED)
    verify(results, figures.parent / CLAIMS_FOLDER, console, measure=plays)
    write_report(results, figures.parent / REPORT_FILE, say)
    return code
