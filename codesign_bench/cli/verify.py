"""`codesign-bench verify`: judge claims on results."""

from __future__ import annotations

import argparse

from rich.console import Console

from codesign_bench.cli.arguments import DEFAULT_CLAIMS, add_out, add_results, add_study
from codesign_bench.study import load_study

HELP = "which claims of a study the results support"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the folders, and whether to measure what no cell holds."""
    add_study(parser)
    add_results(parser)
    add_out(parser, DEFAULT_CLAIMS)
    parser.add_argument(
        "--measure", action="store_true", help="first play tools and policies where claims need it; takes minutes"
    )


def run(options: argparse.Namespace, console: Console) -> int:
    """Judge the claims, print the table and write it."""
    from codesign_bench.claims.verify import verify

    verify(load_study(options.study), options.results, options.out, console, measure=options.measure)
    return 0
