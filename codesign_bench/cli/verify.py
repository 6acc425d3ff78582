"""`codesign-bench verify`: check which claims the results support."""

from __future__ import annotations

import argparse

from rich.console import Console

from codesign_bench.cli.arguments import DEFAULT_CLAIMS, add_out, add_results, add_study, path
from codesign_bench.console import tell_left_out
from codesign_bench.storage.places import REFERENCE
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
    parser.add_argument(
        "--compare",
        type=path,
        metavar="RESULTS",
        help="also judge the claims on these results, e.g. of another machine, and say which verdicts agree: a folder, "
        f"an archive of `pack`, or `{REFERENCE}`",
    )


def run(options: argparse.Namespace, console: Console) -> int:
    """Check the claims, print the table and write it."""
    from codesign_bench.claims.verify import verify
    from codesign_bench.storage.layout import refuse_archive
    from codesign_bench.storage.places import results_folder
    from codesign_bench.storage.survey import lines, survey

    results = results_folder(options.results)
    compared = None if options.compare is None else results_folder(options.compare, must_exist=True)
    if options.measure:
        refuse_archive(results)
    left_out = lines(results, survey(results))
    tell_left_out(left_out)
    if compared is not None:
        tell_left_out(lines(compared, survey(compared)))
    verify(
        load_study(options.study),
        results,
        options.out,
        console,
        measure=options.measure,
        left_out=left_out,
        compared=compared,
    )
    return 0
