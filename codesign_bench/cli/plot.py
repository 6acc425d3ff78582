"""`codesign-bench plot`: draw figures from results."""

from __future__ import annotations

import argparse

from rich.console import Console

from codesign_bench.cli.arguments import DEFAULT_FIGURES, add_out, add_results, add_study, path
from codesign_bench.console import printer, tell_left_out
from codesign_bench.storage.places import REFERENCE
from codesign_bench.study import load_study

HELP = "draw figures from results"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the figures, the results they are drawn from and the folder they are written to."""
    parser.add_argument(
        "figures",
        nargs="*",
        metavar="FIGURE",
        help="default: every figure of the study that can be drawn from the results",
    )
    add_study(parser)
    add_results(parser)
    add_out(parser, DEFAULT_FIGURES)
    parser.add_argument(
        "--compare",
        type=path,
        metavar="DIR",
        help=f"overlay the learning curves of these results, dashed: a folder, an archive of `pack`, or `{REFERENCE}`",
    )


def run(options: argparse.Namespace, console: Console) -> int:
    """Draw the figures and print their paths."""
    from codesign_bench.figures.drawing import draw_figures
    from codesign_bench.storage.places import results_folder
    from codesign_bench.storage.survey import lines, survey

    study = load_study(options.study)
    results = results_folder(options.results)
    compare = None if options.compare is None else results_folder(options.compare, must_exist=True)
    for folder in filter(None, (results, compare)):
        tell_left_out(lines(folder, survey(folder)))
    draw_figures(options.figures, results, options.out, printer(console), compare, study)
    return 0
