"""`codesign-bench plot`: draw figures from results."""

from __future__ import annotations

import argparse
from pathlib import Path

from rich.console import Console

from codesign_bench.cli.arguments import DEFAULT_FIGURES, add_out, add_results
from codesign_bench.console import printer

HELP = "draw the figures that the results allow"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the figures, and the folders that they are drawn from and to."""
    parser.add_argument("figures", nargs="*", metavar="FIGURE", help="default: every figure that the results allow")
    add_results(parser)
    add_out(parser, DEFAULT_FIGURES)
    parser.add_argument(
        "--compare", type=Path, metavar="DIR", help="overlay the learning curves of these results, dashed"
    )


def run(options: argparse.Namespace, console: Console) -> int:
    """Draw the figures and print their paths."""
    from codesign_bench.figures.drawing import draw_figures

    draw_figures(options.figures, options.results, options.out, printer(console), options.compare)
    return 0
