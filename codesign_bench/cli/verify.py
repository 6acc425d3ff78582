"""`codesign-bench verify`: check which claims the results support."""

from __future__ import annotations

import argparse

from rich.console import Console

from codesign_bench.cli.arguments import DEFAULT_CLAIMS, add_out, add_results, add_study
from codesign_bench.console import tell_left_out
from codesign_bench.study import load_study

HELP = "check which claims of a study the results support"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the folders, and whether to measure what is not stored with the cells."""
    add_study(parser)
    add_results(parser)
    add_out(parser, DEFAULT_CLAIMS)
    parser.add_argument(
        "--measure", action="store_true", help="first run the extra episodes that some claims need; takes minutes"
    )


def run(options: argparse.Namespace, console: Console) -> int:
    """Check the claims, print the table and write it."""
    from codesign_bench.claims.verify import verify
    from codesign_bench.storage.layout import refuse_archive
    from codesign_bench.storage.places import results_folder
    from codesign_bench.storage.survey import lines, survey

    results = results_folder(options.results)
    if options.measure:
        refuse_archive(results)
    left_out = lines(results, survey(results))
    tell_left_out(left_out)
    verify(load_study(options.study), results, options.out, console, measure=options.measure, left_out=left_out)
    return 0
