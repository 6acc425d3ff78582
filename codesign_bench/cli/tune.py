"""`codesign-bench tune`: search the settings of a study's methods, with the same random search for each of them."""

from __future__ import annotations

import argparse
import signal
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from codesign_bench.cli.arguments import (
    ALL,
    BEYOND,
    OfKind,
    add_dry_run,
    add_jobs,
    add_json,
    add_profile,
    add_same_code,
    add_study,
    add_sweep,
    add_tensorboard,
    chosen_names,
    groups,
    out_folder,
)
from codesign_bench.config.run_settings import Steps
from codesign_bench.console import printer
from codesign_bench.study import load_study

HELP = "search the settings of every method of a study, with the same effort"
DEFAULT_FOLDER = Path("results/tuning")
"""Each study has a folder below it."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the study, the budget, the output folder, and how to run the cells; the size of the search is the study's."""
    add_study(parser)
    add_profile(parser)
    parser.add_argument(
        "--task", nargs="+", default=[ALL], metavar="T", help="some of the search, beyond, or all of it (default)"
    )
    parser.add_argument("--method", nargs="+", default=[ALL], metavar="M", help="the same for methods")
    parser.add_argument(
        "--steps", type=OfKind(Steps), metavar="N", help="budget of a cell in the last rung (default: the profile's)"
    )
    parser.add_argument("--plan", action="store_true", help="print the rungs and the steps that they take, and stop")
    parser.add_argument(
        "--out", type=out_folder, metavar="DIR", help=f"output folder; default: {DEFAULT_FOLDER}/<name of the study>"
    )
    add_jobs(parser)
    add_sweep(parser)
    add_same_code(parser)
    add_json(parser)
    add_tensorboard(parser)
    add_dry_run(parser, "print the plan of --plan, and how long each method takes, which is measured")


def run(options: argparse.Namespace, console: Console) -> int:
    """Search, or print the plan; return 1 if a cell failed."""
    from codesign_bench.tuning.expected import dry_run
    from codesign_bench.tuning.tune import part_of, print_plan, tune, tuning_of, usable_part

    study = load_study(options.study)
    whole = tuning_of(study)
    tasks = chosen_names("tasks", options.task, _groups_in("tasks", whole.tasks))
    methods = chosen_names("methods", options.method, _groups_in("methods", whole.methods))
    tuning = usable_part(part_of(whole, tasks, methods), printer(console))
    if options.plan:
        print_plan(console, tuning, options.profile, options.steps)
        return 0
    out = DEFAULT_FOLDER / study.name if options.out is None else options.out
    if options.dry_run:
        return dry_run(console, tuning, options.profile, options.steps, out, options.jobs)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # SIGTERM stops a sweep as Ctrl-C does
    return tune(
        study.name,
        tuning,
        profile=options.profile,
        out=out,
        console=console,
        steps=options.steps,
        jobs=options.jobs,
        retry_failed=options.retry_failed,
        backend=options.backend,
        scheduler=options.scheduler,
        same_code=options.same_code,
        tensorboard=options.tensorboard,
    )


def _groups_in(group: str, searched: Sequence[str]) -> dict[str, Sequence[str]]:
    """Return what `all` and `beyond` stand for in a search: all of it, and what of it the paper does not have."""
    return {ALL: searched, BEYOND: [name for name in groups(group)[BEYOND] if name in searched]}
