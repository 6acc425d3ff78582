"""`codesign-bench reproduce`: run the cells that experiments need, then plot, verify and report."""

from __future__ import annotations

import argparse
import signal

from rich.console import Console

from codesign_bench.cell.grid import Count
from codesign_bench.cli.arguments import (
    DEFAULT_FIGURES,
    DEFAULT_RESULTS,
    OfKind,
    add_dry_run,
    add_jobs,
    add_json,
    add_out,
    add_profile,
    add_same_code,
    add_study,
    add_tensorboard,
    out_folder,
)
from codesign_bench.config.profiles import profile_named
from codesign_bench.study import load_study

HELP = "run the cells that figures of a study need, then plot, verify and report"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the experiments, their size, and the output folders."""
    parser.add_argument("experiments", nargs="*", metavar="FIGURE", help="names, or all (default)")
    add_study(parser)
    add_profile(parser)
    parser.add_argument(
        "--seeds",
        type=OfKind(Count),
        metavar="N",
        help="number of seeds per configuration, a count such as 3 (default: the study's)",
    )
    add_jobs(parser)
    add_out(parser, DEFAULT_RESULTS)
    add_same_code(parser)
    add_json(parser)
    add_tensorboard(parser)
    add_dry_run(parser, "list all cells, with the expected time and memory")
    parser.add_argument(
        "--figures",
        type=out_folder,
        default=DEFAULT_FIGURES,
        metavar="DIR",
        help=f"output folder of figures; default: {DEFAULT_FIGURES}",
    )


def run(options: argparse.Namespace, console: Console) -> int:
    """Run, plot, verify and report; return 1 if a cell failed."""
    from codesign_bench.reproduce import reproduce

    profile_named(options.profile)  # refuses an unknown profile before anything runs
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # SIGTERM stops a sweep as Ctrl-C does
    return reproduce(
        load_study(options.study),
        options.experiments,
        profile=options.profile,
        results=options.out,
        figures=options.figures,
        console=console,
        jobs=options.jobs,
        seeds=options.seeds,
        same_code=options.same_code,
        tensorboard=options.tensorboard,
        only_plan=options.dry_run,
    )
